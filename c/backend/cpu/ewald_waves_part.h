/* L1, CPU: rows of waves in one precision: part of ewald_waves.c. */

static void R(to_potential)(const struct gbg_ewald *sum, const struct row *row)
{
    const REAL *influence = (const REAL *)sum->influence + row->influence;
    REAL *mesh = (REAL *)sum->mesh[0] + 2 * row->begin;
    const int64_t waves = sum->plan.choice.cells[0] / 2 + 1;
#pragma omp simd
    for (int64_t n = 0; n < waves; n++) {
        mesh[2 * n] *= influence[n];
        mesh[2 * n + 1] *= influence[n];
    }
}

/* One axis of the field: -i k times the potential; k = first + step n_0. */
static void R(to_field)(const REAL *influence, const REAL *mesh, REAL first, REAL step,
                        int64_t waves, REAL *field)
{
#pragma omp simd
    for (int64_t n = 0; n < waves; n++) {
        REAL factor = influence[n] * (first + step * (REAL)(int32_t)n);
        field[2 * n] = factor * mesh[2 * n + 1];
        field[2 * n + 1] = -factor * mesh[2 * n];
    }
}

static void R(to_fields)(const struct gbg_ewald *sum, const struct row *row)
{
    const REAL *influence = (const REAL *)sum->influence + row->influence;
    const REAL *mesh = (const REAL *)sum->mesh[0] + 2 * row->begin;
    const int64_t waves = sum->plan.choice.cells[0] / 2 + 1;
    for (int a = 0; a < sum->plan.choice.dimension; a++) {
        REAL *field = (REAL *)sum->mesh[a + 1] + 2 * row->begin;
        REAL wave = (REAL)row->wave[a];
        R(to_field)(influence, mesh, a ? wave : 0, a ? 0 : wave, waves, field);
    }
}
