/* The integration loops of rigid_envs.systems.heavy_top.dynamics in C, see kernel_vs_c.py. */
#include "vectors.h"
#include "free_rotation.h"

#define N_STATE 11
#define N_INPUT 8
#define N_PARAMETER 15
#define WEIGHTS SUZUKI

static INLINE vector cross(vector a, vector b) {
    return (vector){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static INLINE vector rotate_inverse(const vec q[], vec x, vec y, vec z) {
    vector p = {-q[1], -q[2], -q[3]}, t = cross(p, (vector){x, y, z}), tt = cross(p, t);
    return (vector){
        2.0 * (q[0] * t.x + tt.x) + x, 2.0 * (q[0] * t.y + tt.y) + y, 2.0 * (q[0] * t.z + tt.z) + z
    };
}

static INLINE void kick(vec y[], const vec u[], const vec p[], double h) {
    vec m = p[3], g = p[4], ell = p[5];
    vector f = rotate_inverse(y, -m * u[6], -m * u[7], -m * g);
    vector t = rotate_inverse(y, u[3], u[4], u[5]);
    y[4] += h * p[6] * (u[0] + t.x - ell * f.y);
    y[5] += h * p[7] * (u[1] + t.y + ell * f.x);
    y[6] += h * p[8] * (u[2] + t.z);
}

static INLINE void step(vec y[], const vec u[], const vec p[], double h) {
    double half = 0.5 * h;
    kick(y, u, p, half);
    free_rotation(y, p + 9, h);
    normalize(y);
    kick(y, u, p, half);
    y[7] += h * (half * u[6] + y[9]); y[8] += h * (half * u[7] + y[10]);
    y[9] += h * u[6]; y[10] += h * u[7];
}

static INLINE void restore(vec y[]) {}

#include "loops.h"
