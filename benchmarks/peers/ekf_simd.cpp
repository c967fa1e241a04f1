// The extended Kalman filter of the acceleration form (equations 7.1 to 7.4), written for 32 lanes side by side:
// one array a quantity, coefficients hoisted, symmetric covariance, scalar updates. States are scaled, so position and
// velocity have steps of their own. How it is built: cpp_lanes.py.
#include <cmath>
#include <type_traits>

constexpr int L = 32;
typedef double Lane[L];

struct Coefficients {
    double T, Tx, Tv, pumped, bias, velocity, square, coulomb, acceleration, damping, quadratic, q[4], r[2];
};

extern "C" void run(long steps, const Coefficients *given, const double *speed, const double *measured, double *state) {
    const Coefficients c = *given;
    alignas(64) Lane x, v, a, b, P00, P01, P02, P03, P11, P12, P13, P22, P23, P33, nis0, nis1;
    for (int l = 0; l < L; l++) {
        const double *s = state + l;
        x[l] = s[0], v[l] = s[L], a[l] = s[2 * L], b[l] = s[3 * L], P00[l] = s[4 * L], P01[l] = s[5 * L];
        P02[l] = s[6 * L], P03[l] = s[7 * L], P11[l] = s[8 * L], P12[l] = s[9 * L], P13[l] = s[10 * L];
        P22[l] = s[11 * L], P23[l] = s[12 * L], P33[l] = s[13 * L], nis0[l] = s[14 * L], nis1[l] = s[15 * L];
    }
    const double T = c.T, Tx = c.Tx, Tv = c.Tv, r0 = c.r[0], r1 = c.r[1];
    // The first sample is only an update: a branch on it inside the loop over lanes would keep g++ from vectors.
    const auto step = [&](auto moves, long k) __attribute__((always_inline)) {
        const double *w = speed + (k > 0 ? k - 1 : 0) * L, *y0 = measured + 2 * k * L, *y1 = y0 + L;
#pragma GCC ivdep
        for (int l = 0; l < L; l++) {
            if constexpr (decltype(moves)::value) {
                double s = v[l] > 0 ? 1.0 : (v[l] < 0 ? -1.0 : 0.0), u = w[l];
                double flow = std::fabs(u) * c.pumped - c.bias, sided = flow > 0 ? flow : 0.0;
                double pump = u > 0 ? sided : -sided;
                double pull = pump + c.velocity * v[l] + c.square * v[l] * v[l] * s + c.coulomb * s
                              + c.acceleration * a[l];
                double decay = c.damping + 2 * c.quadratic * v[l] * s;
                double f21 = T * (b[l] * (c.velocity + 2 * c.square * v[l] * s) + 2 * c.quadratic * s * a[l]);
                double f22 = 1 + T * (b[l] * c.acceleration + decay), f23 = T * pull;
                double ax = a[l] + T * (b[l] * pull + decay * a[l]);
                x[l] += Tx * v[l];
                v[l] += Tv * a[l];
                a[l] = ax;
                double g00 = P00[l] + Tx * P01[l], g01 = P01[l] + Tx * P11[l], g02 = P02[l] + Tx * P12[l],
                       g03 = P03[l] + Tx * P13[l];
                double g11 = P11[l] + Tv * P12[l], g12 = P12[l] + Tv * P22[l], g13 = P13[l] + Tv * P23[l];
                double g21 = f21 * P11[l] + f22 * P12[l] + f23 * P13[l], g22 = f21 * P12[l] + f22 * P22[l] + f23 * P23[l];
                double g23 = f21 * P13[l] + f22 * P23[l] + f23 * P33[l];
                P00[l] = g00 + Tx * g01 + c.q[0];
                P01[l] = g01 + Tv * g02;
                P02[l] = f21 * g01 + f22 * g02 + f23 * g03;
                P03[l] = g03;
                P11[l] = g11 + Tv * g12 + c.q[1];
                P12[l] = f21 * g11 + f22 * g12 + f23 * g13;
                P13[l] = g13;
                P22[l] = f21 * g21 + f22 * g22 + f23 * g23 + c.q[2];
                P23[l] = g23;
                P33[l] += c.q[3];
            }
            double i0 = 1 / (P00[l] + r0), e0 = y0[l] - x[l];
            double k0 = P00[l] * i0, k1 = P01[l] * i0, k2 = P02[l] * i0, k3 = P03[l] * i0;
            x[l] += k0 * e0;
            v[l] += k1 * e0;
            a[l] += k2 * e0;
            b[l] += k3 * e0;
            nis0[l] += e0 * e0 * i0;
            P11[l] -= k1 * P01[l];
            P12[l] -= k1 * P02[l];
            P13[l] -= k1 * P03[l];
            P22[l] -= k2 * P02[l];
            P23[l] -= k2 * P03[l];
            P33[l] -= k3 * P03[l];
            P01[l] -= k0 * P01[l];
            P02[l] -= k0 * P02[l];
            P03[l] -= k0 * P03[l];
            P00[l] -= k0 * P00[l];
            double i1 = 1 / (P11[l] + r1), e1 = y1[l] - v[l];
            k0 = P01[l] * i1, k1 = P11[l] * i1, k2 = P12[l] * i1, k3 = P13[l] * i1;
            x[l] += k0 * e1;
            v[l] += k1 * e1;
            a[l] += k2 * e1;
            b[l] += k3 * e1;
            nis1[l] += e1 * e1 * i1;
            P00[l] -= k0 * P01[l];
            P02[l] -= k0 * P12[l];
            P03[l] -= k0 * P13[l];
            P22[l] -= k2 * P12[l];
            P23[l] -= k2 * P13[l];
            P33[l] -= k3 * P13[l];
            P01[l] -= k0 * P11[l];
            P12[l] -= k1 * P12[l];
            P13[l] -= k1 * P13[l];
            P11[l] -= k1 * P11[l];
        }
    };
    if (steps > 0)
        step(std::false_type{}, 0);
    for (long k = 1; k < steps; k++)
        step(std::true_type{}, k);
    for (int l = 0; l < L; l++) {
        double *s = state + l;
        s[0] = x[l], s[L] = v[l], s[2 * L] = a[l], s[3 * L] = b[l], s[4 * L] = P00[l], s[5 * L] = P01[l];
        s[6 * L] = P02[l], s[7 * L] = P03[l], s[8 * L] = P11[l], s[9 * L] = P12[l], s[10 * L] = P13[l];
        s[11 * L] = P22[l], s[12 * L] = P23[l], s[13 * L] = P33[l], s[14 * L] = nis0[l], s[15 * L] = nis1[l];
    }
}
