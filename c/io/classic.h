/* Side room io: the header of a classic netCDF file (CDF-1, CDF-2, CDF-5): where the data lie. */
#ifndef GBG_IO_CLASSIC_H
#define GBG_IO_CLASSIC_H

#include <stdint.h>

/* netCDF's library neither tells where it puts a variable nor notices that a classic file is cut
 * short (it reads zeros there); both follow from the header. */
struct gbg_classic {
    int version;    /* 1, 2 or 5 */
    int64_t frames; /* records that the header counts */
    int64_t record; /* bytes from one record to the next */
    int64_t needed; /* bytes that a file with these frames has at least */
    int64_t size;   /* bytes that it has */
};

/* A variable to look for, by name; the other members are filled in if `found`. */
struct gbg_classic_variable {
    const char *name;
    int found, is_record, type;
    int64_t begin; /* offset in the file, of the first record for a record variable */
    int64_t bytes; /* of the variable, or of one record of it, without padding */
};

/* Reads the header; n variables are looked for. NULL, or what is wrong with the file. Every count
 * is held against the size of the file, so that a damaged header costs no more time than a good
 * one. */
const char *gbg_classic_read(int descriptor, struct gbg_classic *header,
                             struct gbg_classic_variable *wanted, int n);

/* Offset of a variable in a record. */
static inline int64_t gbg_classic_offset(const struct gbg_classic *header,
                                         const struct gbg_classic_variable *variable, int64_t frame)
{
    return variable->begin + frame * header->record;
}

#endif
