/* The integration loops of rigid_envs.systems.rolling_ball.dynamics in C, see kernel_vs_c.py. */
#include "vectors.h"

#define N_STATE 6
#define N_INPUT 3
#define N_PARAMETER 2
#define WEIGHTS EXACT

static INLINE vec sinc(vec z) { /* sin(x) / x of z = x^2 */
    vec s = z * (-1.0 / 1307674368000.0) + 1.0 / 6227020800.0;
    s = z * (z * s - 1.0 / 39916800.0) + 1.0 / 362880.0;
    s = z * (z * s - 1.0 / 5040.0) + 1.0 / 120.0;
    return z * (z * s - 1.0 / 6.0) + 1.0;
}

static INLINE vec cosine(vec z) { /* cos(x) of z = x^2 */
    vec c = z * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0;
    c = z * (z * c + 1.0 / 479001600.0) - 1.0 / 3628800.0;
    c = z * (z * c + 1.0 / 40320.0) - 1.0 / 720.0;
    return z * (z * (z * c + 1.0 / 24.0) - 0.5) + 1.0;
}

static INLINE void compose(vec w, vec x, vec y, vec z, vec q[]) { /* q becomes (w, x, y, z) q */
    vec a = w * q[0] - (x * q[1] + (y * q[2] + z * q[3]));
    vec b = w * q[1] + (x * q[0] + (y * q[3] - z * q[2]));
    vec c = w * q[2] + (y * q[0] + (z * q[1] - x * q[3]));
    vec d = w * q[3] + (z * q[0] + (x * q[2] - y * q[1]));
    q[0] = a; q[1] = b; q[2] = c; q[3] = d;
}

static INLINE void step(vec y[], const vec u[], const vec p[], double h) {
    double half = 0.5 * h;
    vec a = half * (-u[1] * p[1]), b = half * (u[0] * p[1]), c = half * u[2];
    vec z = a * a + (b * b + c * c), s = sinc(z);
    compose(cosine(z), s * a, s * b, s * c, y);
    y[4] += h * u[0]; y[5] += h * u[1];
}

static INLINE void restore(vec y[]) { /* one step of Newton's method towards |q| = 1 */
    vec s = -0.5 * squared_norm(y) + 1.5;
    for (int k = 0; k < 4; k++) y[k] *= s;
}

#include "loops.h"
