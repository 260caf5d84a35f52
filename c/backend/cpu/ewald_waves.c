/* L1, CPU, per instruction set: waves of the sources become those of the potential and the field.
 */
#include "backend/cpu/cpu.h"
#include "backend/cpu/ewald.h"

/* What a row of waves, all of one n_1 and n_2, is multiplied by. */
struct row {
    int64_t begin;     /* complex number in the mesh */
    int64_t influence; /* number in the influence */
    double wave[3];    /* over the unit of waves; of axes 1 and 2, and for axis 0 that of n_0 = 1 */
};

/* n of the wave that stands at place i: those past the middle are negative. */
static int32_t signed_wave(int64_t i, int32_t cells)
{
    return (int32_t)(i <= cells / 2 ? i : i - cells);
}

static struct row row_at(const struct gbg_ewald *sum, int64_t r)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    const int64_t waves = choice->cells[0] / 2 + 1;
    int64_t at[3] = {1, r % choice->cells[1], r / choice->cells[1]}, mirrored[3] = {0, 0, 0};
    struct row row = {.begin = r * waves};
    for (int a = 0; a < choice->dimension; a++) {
        int32_t n = a ? signed_wave(at[a], choice->cells[a]) : 1;
        mirrored[a] = n < 0 ? -n : n;
        row.wave[a] = 6.283185307179586476925 * n / (choice->length[a] * sum->wave_unit);
    }
    row.influence = (mirrored[2] * (choice->cells[1] / 2 + 1) + mirrored[1]) * waves;
    return row;
}

#define R(name) name##_single
#define REAL float
#include "backend/cpu/ewald_waves_part.h"
#undef R
#undef REAL
#define R(name) name##_double
#define REAL double
#include "backend/cpu/ewald_waves_part.h"

void GBG_ISA_NAME(gbg_ewald_multiply)(struct gbg_device *device, struct gbg_ewald *sum, int fields)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    const int64_t rows =
        (int64_t)choice->cells[1] * (choice->dimension == 3 ? choice->cells[2] : 1);
#pragma omp parallel for num_threads(device->threads) schedule(static)
    for (int64_t r = 0; r < rows; r++) {
        struct row row = row_at(sum, r);
        if (choice->single) {
            (fields ? to_fields_single : to_potential_single)(sum, &row);
        } else {
            (fields ? to_fields_double : to_potential_double)(sum, &row);
        }
    }
}
