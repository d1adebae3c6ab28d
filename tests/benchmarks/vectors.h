/* Vectors, and the functions of rigid_envs.engine that several systems use.
 *
 * A vector is a register: eight doubles with AVX-512, otherwise four.
 * GCC contracts a * b + c to fma by itself.
 */
#include <math.h>

#ifdef __AVX512F__
#define WIDTH 8
#else
#define WIDTH 4
#endif
#define INLINE inline __attribute__((always_inline))

typedef double vec __attribute__((vector_size(8 * WIDTH), aligned(8), may_alias));
typedef struct { vec x, y, z; } vector;

#define S 0.41449077179437573714 /* 1 / (4 - 4^(1/3)) */
#define SUZUKI {S, S, 1.0 - 4.0 * S, S, S}
#define EXACT {1.0}

static INLINE vec root(vec x) {
    vec r;
    for (int k = 0; k < WIDTH; k++) r[k] = sqrt(x[k]);
    return r;
}

static INLINE vec tangent(vec z) { /* tan(x) / x of z = x^2 */
    vec t = z * (z * (62.0 / 2835.0) + 17.0 / 315.0) + 2.0 / 15.0;
    return z * (z * t + 1.0 / 3.0) + 1.0;
}

static INLINE vec squared_norm(const vec q[]) {
    return q[0] * q[0] + (q[1] * q[1] + (q[2] * q[2] + q[3] * q[3]));
}

static INLINE void normalize(vec q[]) {
    vec s = 1.0 / root(squared_norm(q));
    for (int k = 0; k < 4; k++) q[k] *= s;
}
