/* The integration loops of rigid_envs.systems.rolling_disk.dynamics in C, see kernel_vs_c.py. */
#include "vectors.h"

#define N_STATE 9
#define N_INPUT 3
#define N_PARAMETER 14
#define WEIGHTS SUZUKI

typedef struct { vec n, l, e3; } rates;
typedef struct { vec s, c, r; } place; /* sin, cos and 1 / sin of theta */
typedef struct { vec re, im; } pair;

static INLINE pair turned(pair v, vec a) {
    return (pair){v.re - a * v.im, v.im + a * v.re};
}

static INLINE pair fall(rates *w, place *at, vec ratio, vec rim_ratio, double h) {
    vec s = at->s, c = at->c;
    vec x = 0.5 * h * w->l, a = x * tangent(x * x), d = a * a + 1.0;
    vec stands = s - a * (a * s + 2.0 * c), rise = 2.0 * a * (s - a * c);
    vec inverse = 1.0 / (d * stands);
    w->e3 -= rim_ratio * x * w->n;
    w->n = (d * s * w->n - ratio * rise * w->e3) * (d * inverse);
    w->e3 -= rim_ratio * x * w->n;
    vec part = stands * inverse, m = a * at->r, mean = 1.0 - m * c;
    *at = (place){stands * part, rise * part + c, d * d * inverse};
    return (pair){mean + m, mean - m};
}

static INLINE vec roll(rates *w, place at, vec *a, vec *b, const vec u[], const vec p[], double h) {
    vec kick_n = 0.5 * h * p[8] * u[0], kick_3 = 0.5 * h * p[10] * u[2];
    vec wn = w->n + kick_n, w3 = w->e3 + kick_3;
    vec cot = at.c * at.r, spin = w3 - wn * cot;
    vec moment = wn * (p[7] * w3 - p[2] * cot * wn) + (p[13] * at.c + u[1]);
    vec half_phi = 0.5 * h * at.r * wn, half_psi = 0.5 * h * spin;
    vec stretch = tangent(half_phi * half_phi);
    *a = half_phi * stretch;
    *b = half_psi * tangent(half_psi * half_psi);
    *w = (rates){wn + kick_n, w->l + h * p[9] * moment, w3 + kick_3};
    return 2.0 * p[1] * half_psi * stretch / (*a * *a + 1.0);
}

static INLINE void step(vec y[], const vec u[], const vec p[], double h) {
    vec wx = y[0] * y[1], wy = y[0] * y[2], xz = y[1] * y[3], yz = y[2] * y[3];
    vec g1 = xz - wy, g2 = yz + wx, half_s = root(g1 * g1 + g2 * g2), k = 1.0 / half_s;
    rates w = {(g1 * y[4] + g2 * y[5]) * k, (g1 * y[5] - g2 * y[4]) * k, y[6]};
    place at = {
        2.0 * half_s, (y[0] * y[0] + y[3] * y[3]) - (y[1] * y[1] + y[2] * y[2]), 0.5 * k
    };
    vec a, b;
    pair first = fall(&w, &at, p[11], p[12], 0.5 * h);
    vec chord = roll(&w, at, &a, &b, u, p, h);
    pair last = fall(&w, &at, p[11], p[12], 0.5 * h);
    pair high = turned(turned((pair){y[0], y[3]}, a), b);
    pair low = turned(turned((pair){y[1], y[2]}, a), -b);
    vec grown = first.re * last.re, shrunk = first.im * last.im;
    y[0] = grown * high.re; y[1] = shrunk * low.re; y[2] = shrunk * low.im; y[3] = grown * high.im;
    normalize(y);
    vec sine = 2.0 * b / (b * b + 1.0), versine = sine * b, n1 = g1 * k, n2 = g2 * k;
    vec n1_new = (sine * n2 - versine * n1) + n1;
    vec n2_new = (-sine * n1 - versine * n2) + n2;
    pair l = turned((pair){(yz - wx) * k, -(xz + wy) * k}, a);
    y[4] = n1_new * w.n - n2_new * w.l;
    y[5] = n2_new * w.n + n1_new * w.l;
    y[6] = w.e3;
    y[7] += chord * l.re; y[8] += chord * l.im;
}

static INLINE void restore(vec y[]) {}

#include "loops.h"
