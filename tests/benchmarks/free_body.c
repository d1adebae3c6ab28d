/* The integration loop of rigid_envs.kernels.free_body in C, on vectors of eight doubles.
 *
 * What the compiled Python is measured against, by kernel_vs_c.py. Same memory (blocks of LANES
 * rows, structure of arrays), same splitting, same five stages, stage loop outside and row loop
 * inside. GCC contracts a * b + c to fma by itself.
 */
#include <math.h>

#define LANES 64
#define WIDTH 8
#define N_STATE 7
#define N_INPUT 3
#define N_PARAMETER 12
#define SIZE ((N_STATE + N_INPUT + N_PARAMETER) * LANES)

typedef double vec __attribute__((vector_size(8 * WIDTH), aligned(8), may_alias));

static const double S = 0.41449077179437573714; /* 1 / (4 - 4^(1/3)) */

static inline vec inverse_root(vec x) {
    vec r;
    for (int k = 0; k < WIDTH; k++) r[k] = sqrt(x[k]);
    return 1.0 / r;
}

static inline vec tangent(vec z) { /* tan(x) / x of z = x^2 */
    vec t = z * (z * (62.0 / 2835.0) + 17.0 / 315.0) + 2.0 / 15.0;
    return z * (z * t + 1.0 / 3.0) + 1.0;
}

static inline void turn_about_1(vec y[], vec a, vec r23, vec r32) {
    vec s = 2.0 * a / (a * a + 1.0), m = s * a;
    vec w = y[0] - a * y[1], x = y[1] + a * y[0], j = y[2] + a * y[3], k = y[3] - a * y[2];
    vec w2 = (s * r32 * y[6] - m * y[5]) + y[5], w3 = (-s * r23 * y[5] - m * y[6]) + y[6];
    y[0] = w; y[1] = x; y[2] = j; y[3] = k; y[5] = w2; y[6] = w3;
}

static inline void turn_about_3(vec y[], vec x, vec r12, vec r21) {
    vec a = x * tangent(x * x), s = 2.0 * a / (a * a + 1.0), m = s * a;
    vec w = y[0] - a * y[3], i = y[1] + a * y[2], j = y[2] - a * y[1], k = y[3] + a * y[0];
    vec w1 = (s * r21 * y[5] - m * y[4]) + y[4], w2 = (-s * r12 * y[4] - m * y[5]) + y[5];
    y[0] = w; y[1] = i; y[2] = j; y[3] = k; y[4] = w1; y[5] = w2;
}

static inline void turn_about_momentum(vec q[], vec x, vec y, vec z) {
    vec t = tangent(x * x + (y * y + z * z));
    vec b = t * x, c = t * y, d = t * z;
    vec w = q[0] - (q[1] * b + (q[2] * c + q[3] * d));
    vec i = q[0] * b + (q[1] + (q[2] * d - q[3] * c));
    vec j = q[0] * c + (q[2] + (q[3] * b - q[1] * d));
    vec k = q[0] * d + (q[3] + (q[1] * c - q[2] * b));
    q[0] = w; q[1] = i; q[2] = j; q[3] = k;
}

static inline void stage(vec y[], const vec u[], const vec p[], double h) {
    vec k1 = 0.5 * h * p[3], k2 = 0.5 * h * p[4], k3 = 0.5 * h * p[5];
    y[4] += k1 * u[0]; y[5] += k2 * u[1]; y[6] += k3 * u[2];
    turn_about_1(y, 0.25 * h * p[6] * y[4], p[10], p[11]);
    double half = 0.5 * h;
    turn_about_momentum(y, half * (p[8] * y[4]), half * y[5], half * (p[11] * y[6]));
    turn_about_3(y, 0.5 * h * p[7] * y[6], p[8], p[9]);
    turn_about_1(y, 0.25 * h * p[6] * y[4], p[10], p[11]);
    y[4] += k1 * u[0]; y[5] += k2 * u[1]; y[6] += k3 * u[2];
}

static inline void restore(vec y[]) {
    vec s = inverse_root(y[0] * y[0] + (y[1] * y[1] + (y[2] * y[2] + y[3] * y[3])));
    for (int k = 0; k < 4; k++) y[k] *= s;
}

static inline void read(const double *block, int first, int n, int i, vec out[]) {
    for (int k = 0; k < n; k++) out[k] = *(const vec *)(block + (first + k) * LANES + i);
}

static inline void write(double *block, int n, int i, const vec in[]) {
    for (int k = 0; k < n; k++) *(vec *)(block + k * LANES + i) = in[k];
}

static inline void stages(vec y[], const vec u[], const vec p[], double h, int first, int last) {
    const double weights[5] = {S, S, 1.0 - 4.0 * S, S, S};
    for (int j = first; j < last; j++) stage(y, u, p, weights[j] * h);
}

/* The loop of rigid_envs.kernels.rows.integrate: every stage goes over the rows of a block. */
void stage_by_stage(double *memory, long n_blocks, double h, long n_substeps) {
    for (long b = 0; b < n_blocks; b++) {
        double *block = memory + b * SIZE;
        for (long substep = 0; substep < n_substeps; substep++) {
            for (int j = 0; j < 5; j++)
                for (int i = 0; i < LANES; i += WIDTH) {
                    vec y[N_STATE], u[N_INPUT], p[N_PARAMETER];
                    read(block, 0, N_STATE, i, y);
                    read(block, N_STATE, N_INPUT, i, u);
                    read(block, N_STATE + N_INPUT, N_PARAMETER, i, p);
                    stages(y, u, p, h, j, j + 1);
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

/* Eight rows go through all the stages before the next eight: the least traffic to memory, but one
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
                stages(y, u, p, h, 0, 5);
                restore(y);
            }
            write(block, N_STATE, i, y);
        }
    }
}
