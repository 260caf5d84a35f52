/* Side room io: the header of a classic netCDF file, by its published grammar (the netCDF "Classic
 * Format Specification"): magic, number of records, dimensions, attributes, variables. */
#include "io/classic.h"

#include <string.h>
#include <sys/stat.h>

#include "core/file.h"

enum { MOST_DIMENSIONS = 1024, NAME_BYTES = 256 };
enum { TAG_DIMENSION = 10, TAG_VARIABLE = 11, TAG_ATTRIBUTE = 12 };

static const char damaged[] = "its netCDF header is damaged";

struct input {
    int descriptor;
    int64_t at, size;
    int count_bytes, offset_bytes; /* width of counts and of file offsets in this version */
    const char *defect;
    int n_dimensions;
    int64_t dimension[MOST_DIMENSIONS]; /* lengths; 0: records */
};

/* Totals over the record variables, while the list is read. */
struct totals {
    int64_t padded, unpadded, last; /* last: end of the first record, or of the fixed variables */
    int64_t last_record;
    int records;
};

static int64_t padded(int64_t bytes)
{
    return (bytes + 3) & ~INT64_C(3);
}

static int64_t number(struct input *input, int bytes)
{
    unsigned char raw[8];
    if (!input->defect && gbg_file_read(input->descriptor, raw, (size_t)bytes, input->at) != 0) {
        input->defect = "it ends inside its netCDF header";
    }
    if (input->defect) {
        return 0;
    }
    uint64_t value = 0;
    for (int k = 0; k < bytes; k++) {
        value = value << 8 | raw[k];
    }
    input->at += bytes;
    return (int64_t)value;
}

static int64_t count_up_to(struct input *input, int64_t most)
{
    int64_t value = number(input, input->count_bytes);
    if (value < 0 || value > most) {
        input->defect = input->defect ? input->defect : damaged;
        return 0;
    }
    return value;
}

static void skip(struct input *input, int64_t bytes)
{
    input->at += padded(bytes);
    if (input->at > input->size && !input->defect) {
        input->defect = "it ends inside its netCDF header";
    }
}

/* Number of entries of a list that starts with `tag`, or is absent (two zeros). */
static int64_t list_length(struct input *input, int tag)
{
    int64_t found = number(input, 4);
    int64_t length = count_up_to(input, input->size);
    if (!input->defect && found != tag && (found != 0 || length != 0)) {
        input->defect = damaged;
    }
    return input->defect ? 0 : length;
}

static void read_name(struct input *input, char name[NAME_BYTES])
{
    int64_t length = count_up_to(input, input->size);
    size_t kept = length < NAME_BYTES ? (size_t)length : 0;
    name[0] = 0;
    if (!input->defect && kept > 0 &&
        gbg_file_read(input->descriptor, name, kept, input->at) == 0) {
        name[kept] = 0;
    }
    skip(input, length);
}

/* Bytes of an element of a netCDF type. */
static int64_t type_bytes(struct input *input, int64_t type)
{
    static const signed char bytes[] = {0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
    if (type < 1 || type >= (int64_t)sizeof bytes) {
        input->defect = input->defect ? input->defect : damaged;
        return 1;
    }
    return bytes[type];
}

static void skip_attributes(struct input *input)
{
    char name[NAME_BYTES];
    for (int64_t left = list_length(input, TAG_ATTRIBUTE); left > 0 && !input->defect; left--) {
        read_name(input, name);
        int64_t element = type_bytes(input, number(input, 4));
        int64_t length = count_up_to(input, input->size);
        skip(input, element * length);
    }
}

static void read_dimensions(struct input *input)
{
    char name[NAME_BYTES];
    int64_t length = list_length(input, TAG_DIMENSION);
    if (length > MOST_DIMENSIONS) {
        input->defect = "it has more than 1024 dimensions";
        return;
    }
    input->n_dimensions = (int)length;
    for (int d = 0; d < input->n_dimensions && !input->defect; d++) {
        read_name(input, name);
        input->dimension[d] = count_up_to(input, INT64_MAX);
    }
}

/* Elements of a variable (of one record of it): the product of its dimensions. */
static int64_t read_shape(struct input *input, int *is_record)
{
    int64_t rank = count_up_to(input, MOST_DIMENSIONS), elements = 1;
    *is_record = 0;
    for (int64_t k = 0; k < rank && !input->defect; k++) {
        int64_t d = count_up_to(input, input->n_dimensions - 1);
        int64_t length = input->dimension[d];
        if (length == 0 && k == 0) {
            *is_record = 1;
        } else if (length == 0 || elements > INT64_MAX / 16 / length) {
            input->defect = input->defect ? input->defect : damaged;
        } else {
            elements *= length;
        }
    }
    return elements;
}

static void add_to(struct totals *totals, const struct gbg_classic_variable *variable)
{
    int64_t end = variable->begin + variable->bytes;
    if (variable->is_record) {
        totals->records++;
        totals->padded += padded(variable->bytes);
        totals->unpadded += variable->bytes;
        totals->last_record = end > totals->last_record ? end : totals->last_record;
    } else if (end > totals->last) {
        totals->last = end;
    }
}

static void read_variable(struct input *input, struct totals *totals,
                          struct gbg_classic_variable *wanted, int n)
{
    char name[NAME_BYTES];
    struct gbg_classic_variable variable = {.found = 1};
    read_name(input, name);
    int64_t elements = read_shape(input, &variable.is_record);
    skip_attributes(input);
    int64_t type = number(input, 4);
    variable.type = (int)type;
    variable.bytes = elements * type_bytes(input, type);
    number(input, input->count_bytes); /* the stored size, which overflows for large variables */
    variable.begin = number(input, input->offset_bytes);
    if (variable.begin < 0 || variable.begin > INT64_MAX / 4 || totals->padded > INT64_MAX / 4) {
        input->defect = input->defect ? input->defect : damaged;
    }
    if (input->defect) {
        return;
    }
    add_to(totals, &variable);
    for (int k = 0; k < n; k++) {
        if (strcmp(wanted[k].name, name) == 0) {
            variable.name = wanted[k].name;
            wanted[k] = variable;
        }
    }
}

static void read_magic(struct input *input, struct gbg_classic *header)
{
    int64_t magic = number(input, 4);
    header->version = (int)(magic & 0xff);
    if (magic >> 8 != ('C' << 16 | 'D' << 8 | 'F') ||
        (header->version != 1 && header->version != 2 && header->version != 5)) {
        input->defect = input->defect ? input->defect : "it is not a classic netCDF file";
        return;
    }
    input->count_bytes = header->version == 5 ? 8 : 4;
    input->offset_bytes = header->version == 1 ? 4 : 8;
    header->frames = number(input, input->count_bytes);
    if (header->frames == (header->version == 5 ? -1 : INT64_C(0xffffffff))) {
        input->defect = "its number of frames was never written (streaming)";
    } else if (header->frames < 0) {
        input->defect = damaged;
    }
}

/* A lone record variable is not padded to 4 bytes, several are. */
static void sum_up(struct input *input, struct gbg_classic *header, const struct totals *totals)
{
    header->record = totals->records == 1 ? totals->unpadded : totals->padded;
    header->size = input->size;
    header->needed = totals->last > input->at ? totals->last : input->at;
    if (totals->records == 0 || header->frames == 0) {
        return;
    }
    if (header->record > 0 && header->frames > (INT64_MAX / 2) / header->record) {
        input->defect = damaged;
        return;
    }
    int64_t end = totals->last_record + (header->frames - 1) * header->record;
    header->needed = end > header->needed ? end : header->needed;
}

const char *gbg_classic_read(int descriptor, struct gbg_classic *header,
                             struct gbg_classic_variable *wanted, int n)
{
    struct stat status;
    struct input input = {.descriptor = descriptor};
    struct totals totals = {0};
    *header = (struct gbg_classic){0};
    for (int k = 0; k < n; k++) {
        wanted[k].found = 0;
    }
    if (fstat(descriptor, &status) != 0) {
        return "its size cannot be had";
    }
    input.size = (int64_t)status.st_size;
    read_magic(&input, header);
    read_dimensions(&input);
    skip_attributes(&input);
    for (int64_t left = list_length(&input, TAG_VARIABLE); left > 0 && !input.defect; left--) {
        read_variable(&input, &totals, wanted, n);
    }
    if (!input.defect) {
        sum_up(&input, header, &totals);
    }
    return input.defect;
}
