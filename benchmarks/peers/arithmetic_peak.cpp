// How many multiplications and additions a core does in a second: independent fused multiply-adds in registers.
constexpr int WIDTH = BYTES / 8, CHAINS = 12;  // latency 4, two a cycle: 8 chains fill the units
typedef double Vector __attribute__((vector_size(BYTES)));

extern "C" double peak(long rounds, double factor) {
    Vector sums[CHAINS], x;
    for (int l = 0; l < WIDTH; l++)
        x[l] = factor;
    for (int c = 0; c < CHAINS; c++)
        sums[c] = x + c;
    for (long k = 0; k < rounds; k++)
        for (int c = 0; c < CHAINS; c++)
            sums[c] = sums[c] * x + x;
    double total = 0;
    for (int c = 0; c < CHAINS; c++)
        for (int l = 0; l < WIDTH; l++)
            total += sums[c][l];
    return total;
}
