// The formulas as a C programmer would write them, for the compiler to vectorise: no guard, no check, e = 1.
// cc -O3 -march=native -fopenmp -shared -fPIC loops.c -o loops.so -lm

#include <math.h>

#define EACH_PAIR _Pragma("omp parallel for num_threads(threads) schedule(static)") for (long k = 0; k < n; k++)
#define IN const double *restrict
#define OUT double *restrict

void resolve_1d(long n, int threads, IN m1, IN m2, IN v1, IN v2, OUT u1, OUT u2)
{
    EACH_PAIR {
        double q = 2.0 * (v1[k] - v2[k]) / (m1[k] + m2[k]);
        u1[k] = v1[k] - m2[k] * q;
        u2[k] = v2[k] + m1[k] * q;
    }
}

void resolve_2d(long n, int threads, IN m1, IN m2, IN v1x, IN v1y, IN v2x, IN v2y, IN nx, IN ny,
                OUT u1x, OUT u1y, OUT u2x, OUT u2y)
{
    EACH_PAIR {
        double closing = (v1x[k] - v2x[k]) * nx[k] + (v1y[k] - v2y[k]) * ny[k];
        double q = 2.0 * closing / ((m1[k] + m2[k]) * (nx[k] * nx[k] + ny[k] * ny[k]));
        double j1 = m2[k] * q, j2 = m1[k] * q;
        u1x[k] = v1x[k] - j1 * nx[k];
        u1y[k] = v1y[k] - j1 * ny[k];
        u2x[k] = v2x[k] + j2 * nx[k];
        u2y[k] = v2y[k] + j2 * ny[k];
    }
}

void resolve_3d(long n, int threads, IN m1, IN m2, IN v1x, IN v1y, IN v1z, IN v2x, IN v2y, IN v2z,
                IN nx, IN ny, IN nz, OUT u1x, OUT u1y, OUT u1z, OUT u2x, OUT u2y, OUT u2z)
{
    EACH_PAIR {
        double closing = (v1x[k] - v2x[k]) * nx[k] + (v1y[k] - v2y[k]) * ny[k] + (v1z[k] - v2z[k]) * nz[k];
        double q = 2.0 * closing / ((m1[k] + m2[k]) * (nx[k] * nx[k] + ny[k] * ny[k] + nz[k] * nz[k]));
        double j1 = m2[k] * q, j2 = m1[k] * q;
        u1x[k] = v1x[k] - j1 * nx[k];
        u1y[k] = v1y[k] - j1 * ny[k];
        u1z[k] = v1z[k] - j1 * nz[k];
        u2x[k] = v2x[k] + j2 * nx[k];
        u2y[k] = v2y[k] + j2 * ny[k];
        u2z[k] = v2z[k] + j2 * nz[k];
    }
}

void resolve_polar(long n, int threads, IN m1, IN m2, IN v1, IN theta1, IN v2, IN theta2, IN phi,
                OUT u1x, OUT u1y, OUT u2x, OUT u2y)
{
    EACH_PAIR {
        double c = cos(phi[k]), s = sin(phi[k]);
        double ax = v1[k] * cos(theta1[k]), ay = v1[k] * sin(theta1[k]);
        double bx = v2[k] * cos(theta2[k]), by = v2[k] * sin(theta2[k]);
        double q = 2.0 * ((ax - bx) * c + (ay - by) * s) / (m1[k] + m2[k]);
        double j1 = m2[k] * q, j2 = m1[k] * q;
        u1x[k] = ax - j1 * c;
        u1y[k] = ay - j1 * s;
        u2x[k] = bx + j2 * c;
        u2y[k] = by + j2 * s;
    }
}
