/* What a core can do: operations that wait for nothing, on numbers that stay in registers.
 *
 * Each function does n operations of its kind on each of NUMBERS numbers.
 */
#include "vectors.h"

#define N 12 /* more than are under way at once; with `a`, no more than there are registers */
#define NUMBERS (N * WIDTH)

#define REPEATED(name, operation)                                                                  \
    double name(long n) {                                                                          \
        const vec a = 0.5 - (vec){};                                                               \
        vec x[N];                                                                                  \
        for (int k = 0; k < N; k++) x[k] = 1.0 + k - (vec){};                                      \
        for (long i = 0; i < n; i++)                                                               \
            for (int k = 0; k < N; k++) x[k] = operation;                                          \
        double total = 0.0; /* of all, so that all are needed */                                   \
        for (int k = 0; k < N; k++)                                                                \
            for (int j = 0; j < WIDTH; j++) total += x[k][j];                                      \
        return total;                                                                              \
    }

REPEATED(multiply_add, x[k] * a + a)
REPEATED(sum, x[k] + a)
REPEATED(quotient, a / x[k])
REPEATED(square_root, root(x[k]))

int numbers(void) { return NUMBERS; }
