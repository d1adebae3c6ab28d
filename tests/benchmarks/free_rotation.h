/* rigid_envs.systems.free_body.dynamics.free_rotation: y begins with q and omega, r are the six ratios. */

static INLINE void turn_about_1(vec y[], vec a, vec r23, vec r32) {
    vec s = 2.0 * a / (a * a + 1.0), m = s * a;
    vec w = y[0] - a * y[1], x = y[1] + a * y[0], j = y[2] + a * y[3], k = y[3] - a * y[2];
    vec w2 = (s * r32 * y[6] - m * y[5]) + y[5], w3 = (-s * r23 * y[5] - m * y[6]) + y[6];
    y[0] = w; y[1] = x; y[2] = j; y[3] = k; y[5] = w2; y[6] = w3;
}

static INLINE void turn_about_3(vec y[], vec x, vec r12, vec r21) {
    vec a = x * tangent(x * x), s = 2.0 * a / (a * a + 1.0), m = s * a;
    vec w = y[0] - a * y[3], i = y[1] + a * y[2], j = y[2] - a * y[1], k = y[3] + a * y[0];
    vec w1 = (s * r21 * y[5] - m * y[4]) + y[4], w2 = (-s * r12 * y[4] - m * y[5]) + y[5];
    y[0] = w; y[1] = i; y[2] = j; y[3] = k; y[4] = w1; y[5] = w2;
}

static INLINE void turn_about_momentum(vec q[], vec x, vec y, vec z) {
    vec t = tangent(x * x + (y * y + z * z));
    vec b = t * x, c = t * y, d = t * z;
    vec w = q[0] - (q[1] * b + (q[2] * c + q[3] * d));
    vec i = q[0] * b + (q[1] + (q[2] * d - q[3] * c));
    vec j = q[0] * c + (q[2] + (q[3] * b - q[1] * d));
    vec k = q[0] * d + (q[3] + (q[1] * c - q[2] * b));
    q[0] = w; q[1] = i; q[2] = j; q[3] = k;
}

static INLINE void free_rotation(vec y[], const vec r[], double h) {
    double half = 0.5 * h;
    turn_about_1(y, 0.25 * h * r[0] * y[4], r[4], r[5]);
    turn_about_momentum(y, half * (r[2] * y[4]), half * y[5], half * (r[5] * y[6]));
    turn_about_3(y, half * r[1] * y[6], r[2], r[3]);
    turn_about_1(y, 0.25 * h * r[0] * y[4], r[4], r[5]);
}
