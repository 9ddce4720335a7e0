/* What a message costs: its round trip, and how many go one way in a second,
 * per port and size.  Writes channels.csv. */
#include "bench.h"

#include <string.h>

#include "clock.h"
#include "progress.h"

#define MAX_LEN 16384
#define ROUNDS 7

static const int sizes[] = { 0, 64, 256, 1024, 4096, MAX_LEN };
#define SIZES ((int)(sizeof sizes / sizeof *sizes))

/* Messages of a round.  The slower the port, the fewer. */
static const struct {
    int warm, trips, stream;
} plans[] = {
    [ON_LOOP] = { 20, 300, 1000 },
    [ON_THREADS] = { 500, 5000, 20000 },
    [ON_LCM] = { 20, 300, 1000 },
};

struct result {
    struct samples trip;        /* us there and back                        */
    struct samples message;     /* us a message, one way: one a round       */
};

struct job {
    enum bench_port port;
    int len;
    struct result *result;
};

static void send(jl_chan *to, const unsigned char *msg, int len)
{
    bench_must(jl_chan_send(to, msg, len, BENCH_WAIT_US) == JL_OK, "send");
}

static void recv(jl_chan *from, unsigned char *msg, int len)
{
    bench_must(jl_chan_recv(from, msg, MAX_LEN, BENCH_WAIT_US) == len,
               "receive");
}

/* Node 0 asks and measures, node 1 answers. */
static void body(int node, jl_chan **to, jl_chan **from, void *context)
{
    struct job *job = context;
    int warm = plans[job->port].warm, trips = plans[job->port].trips;
    int stream = plans[job->port].stream, len = job->len, i;
    unsigned char msg[MAX_LEN];
    double before;

    memset(msg, node, sizeof msg);
    for (i = 0; i < warm + trips; i++)
        if (node == 0) {
            before = clock_us();
            send(to[1], msg, len);
            recv(from[1], msg, len);
            if (i >= warm)
                samples_add(&job->result->trip, clock_us() - before);
        } else {
            recv(from[0], msg, len);
            send(to[0], msg, len);
        }
    before = clock_us();
    for (i = 0; i < stream; i++)
        if (node == 0)
            send(to[1], msg, len);
        else
            recv(from[0], msg, len);
    if (node == 0) {
        recv(from[1], msg, 0);          /* all have arrived */
        samples_add(&job->result->message,
                    (clock_us() - before) / (double)stream);
    } else {
        send(to[0], msg, 0);
    }
}

static void report(FILE *csv, int port, int len, struct result *r)
{
    double rate = 1e6 / samples_median(&r->message);

    printf("%-8s %8d %10.2f %10.2f %12.0f\n", bench_port_names[port], len,
           samples_least(&r->trip), samples_median(&r->trip), rate);
    fprintf(csv, "%s,%d,%.3f,%.3f,%.0f\n", bench_port_names[port], len,
            samples_least(&r->trip), samples_median(&r->trip), rate);
}

int main(int argc, char **argv)
{
    static struct result results[3][SIZES];
    int ports = bench_network() ? 3 : 2, round, port, i, done = 0;
    struct out_file csv;

    progress_begin("channels");
    for (round = 0; round < ROUNDS; round++)
        for (i = 0; i < SIZES; i++)
            for (port = 0; port < ports; port++) {
                struct job job = { (enum bench_port)port, sizes[i],
                                   &results[port][i] };

                bench_run(job.port, 2, 0, MAX_LEN, body, &job);
                progress(++done, ROUNDS * SIZES * ports);
            }
    progress_begin(NULL);
    printf("Channels with %d slots, two nodes, %d rounds:\n", BENCH_SLOTS,
           ROUNDS);
    printf("%-8s %8s %10s %10s %12s\n", "", "", "round trip", "us",
           "messages/s");
    printf("%-8s %8s %10s %10s %12s\n", "port", "octets", "least", "median",
           "median");
    bench_open(&csv, argc, argv, "channels.csv");
    fprintf(csv.stream, "port,octets,trip_least_us,trip_median_us,"
            "messages_per_s\n");
    for (port = 0; port < ports; port++)
        for (i = 0; i < SIZES; i++)
            report(csv.stream, port, sizes[i], &results[port][i]);
    bench_close(&csv);
    return 0;
}
