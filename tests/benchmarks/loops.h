/* The integration loops of a system, whose file defines its sizes, WEIGHTS, step and restore.
 *
 * Same memory as rigid_envs.engine.rows: blocks of LANES rows, structure of arrays.
 */
#define LANES 64
#define SIZE ((N_STATE + N_INPUT + N_PARAMETER) * LANES)

static const double weights[] = WEIGHTS;

#define N_STAGES ((int)(sizeof weights / sizeof weights[0]))

static INLINE void read(const double *block, int first, int n, int i, vec out[]) {
    for (int k = 0; k < n; k++) out[k] = *(const vec *)(block + (first + k) * LANES + i);
}

static INLINE void write(double *block, int n, int i, const vec in[]) {
    for (int k = 0; k < n; k++) *(vec *)(block + k * LANES + i) = in[k];
}

/* The loop of rigid_envs.engine.rows.integrate: every stage goes over the rows of a block. */
void stage_by_stage(double *memory, long n_blocks, double h, long n_substeps) {
    for (long b = 0; b < n_blocks; b++) {
        double *block = memory + b * SIZE;
        for (long substep = 0; substep < n_substeps; substep++) {
            for (int j = 0; j < N_STAGES; j++)
                for (int i = 0; i < LANES; i += WIDTH) {
                    vec y[N_STATE], u[N_INPUT], p[N_PARAMETER];
                    read(block, 0, N_STATE, i, y);
                    read(block, N_STATE, N_INPUT, i, u);
                    read(block, N_STATE + N_INPUT, N_PARAMETER, i, p);
                    step(y, u, p, weights[j] * h);
                    write(block, N_STATE, i, y);
                }
            for (int i = 0; i < LANES; i += WIDTH) {
                vec y[N_STATE];
                read(block, 0, N_STATE, i, y);
                restore(y);
                write(block, N_STATE, i, y);
            }
        }
    }
}

/* A vector of rows goes through all stages before the next one: the least traffic to memory, but a
 * long chain of operations that wait for each other. */
void in_registers(double *memory, long n_blocks, double h, long n_substeps) {
    for (long b = 0; b < n_blocks; b++) {
        double *block = memory + b * SIZE;
        for (int i = 0; i < LANES; i += WIDTH) {
            vec y[N_STATE], u[N_INPUT], p[N_PARAMETER];
            read(block, 0, N_STATE, i, y);
            read(block, N_STATE, N_INPUT, i, u);
            read(block, N_STATE + N_INPUT, N_PARAMETER, i, p);
            for (long substep = 0; substep < n_substeps; substep++) {
                for (int j = 0; j < N_STAGES; j++) step(y, u, p, weights[j] * h);
                restore(y);
            }
            write(block, N_STATE, i, y);
        }
    }
}
