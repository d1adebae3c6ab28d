/* The integration loops of rigid_envs.systems.free_body.dynamics in C, see kernel_vs_c.py. */
#include "vectors.h"
#include "free_rotation.h"

#define N_STATE 7
#define N_INPUT 3
#define N_PARAMETER 12
#define WEIGHTS SUZUKI

static INLINE void step(vec y[], const vec u[], const vec p[], double h) {
    vec k1 = 0.5 * h * p[3], k2 = 0.5 * h * p[4], k3 = 0.5 * h * p[5];
    y[4] += k1 * u[0]; y[5] += k2 * u[1]; y[6] += k3 * u[2];
    free_rotation(y, p + 6, h);
    y[4] += k1 * u[0]; y[5] += k2 * u[1]; y[6] += k3 * u[2];
}

static INLINE void restore(vec y[]) { normalize(y); }

#include "loops.h"
