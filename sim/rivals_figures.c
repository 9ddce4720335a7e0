/* What many runs say, and how surely. */
#include <math.h>

#include "rivals.h"

static const struct rivals_error *error_of(const struct rivals *r, long run,
                                           int situation, int rival,
                                           int quantity)
{
    return &r->run[run].of[situation][rival][quantity];
}

/* Of N numbers whose sum, and whose squares' sum, are these. */
static struct rivals_figure mean_of(double sum, double squares, double N)
{
    struct rivals_figure mean;

    mean.value = sum / N;
    mean.error = sqrt(fmax(squares / N - mean.value * mean.value, 0)
                      / (N - 1));
    return mean;
}

struct rivals_figure rivals_rms(const struct rivals *r, int situation,
                                int rival, int quantity, int final)
{
    double sum = 0, squares = 0;
    struct rivals_figure figure;
    long i;

    for (i = 0; i < r->runs; i++) {
        const struct rivals_error *e = error_of(r, i, situation, rival,
                                                quantity);
        double square = pow(final ? e->final : e->rms, 2);

        sum += square;
        squares += square * square;
    }
    figure = mean_of(sum, squares, (double)r->runs);
    figure.value = sqrt(figure.value);
    figure.error /= 2 * figure.value;
    return figure;
}

struct rivals_figure rivals_mean(const struct rivals *r, int situation,
                                 int rival, int quantity)
{
    double sum = 0, squares = 0;
    long i;

    for (i = 0; i < r->runs; i++) {
        double mean = error_of(r, i, situation, rival, quantity)->mean;

        sum += mean;
        squares += mean * mean;
    }
    return mean_of(sum, squares, (double)r->runs);
}

double rivals_step(const struct rivals *r, int situation, int rival,
                   int quantity, int step)
{
    return sqrt(r->squares[situation][rival][quantity][step]
                / (double)r->runs);
}

static double log_ratio(const struct rivals *r, long run, int situation,
                        int rival, int quantity)
{
    return log(error_of(r, run, situation, rival, quantity)->rms
               / error_of(r, run, situation, RIVAL_EKF, quantity)->rms);
}

struct rivals_figure rivals_ratio(const struct rivals *r, int situation,
                                  int rival, int quantity)
{
    double sum = 0, squares = 0;
    struct rivals_figure ratio;
    long i;

    for (i = 0; i < r->runs; i++) {
        double off = log_ratio(r, i, situation, rival, quantity);

        sum += off;
        squares += off * off;
    }
    ratio = mean_of(sum, squares, (double)r->runs);
    ratio.value = exp(ratio.value);
    ratio.error *= ratio.value;
    return ratio;
}

long rivals_nearer(const struct rivals *r, int situation, int rival,
                   int quantity)
{
    long i, count = 0;

    for (i = 0; i < r->runs; i++)
        count += log_ratio(r, i, situation, rival, quantity) < 0;
    return count;
}

const char *rivals_verdict(struct rivals_figure ratio)
{
    return ratio.value + 2 * ratio.error < 0.99 ? "better"
        : ratio.value - 2 * ratio.error > 1.01 ? "worse" : "no different";
}
