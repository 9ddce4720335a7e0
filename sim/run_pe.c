/* A PE's part of a run, for any port. */
#include "run.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bank.h"
#include "complain.h"
#include "jumplink/par.h"

int run_max_len(const struct model *model)
{
    return model->gains != NULL ? JL_PAR_CG_MSG(model->M, model->m)
        : JL_PAR_MSG(model->M, model->n, model->m);
}

long run_message_us(const struct options *options)
{
    return options->timeout_us + options->timeout_us / 4;
}

/* A ring's exchange sends up to pes/2 messages to a neighbour. */
int run_slots(const struct options *options)
{
    return options->topology == JL_TOPO_RING && options->pes > 4
        ? options->pes / 2 : 2;
}

jl_u32 run_fingerprint(const struct model *model,
                       const struct options *options)
{
    const char *form = options_form(options);
    unsigned char more[5 + 4 + JL_REAL_OCTETS];
    jl_u32 crc = jl_crc32(model->fingerprint, (const unsigned char *)form,
                          (int)strlen(form));

    more[0] = (unsigned char)options->pes;
    more[1] = (unsigned char)(options->filter == FILTER_KF ? options->mode + 2
                                                           : 0);
    more[2] = JL_REAL_OCTETS;
    more[3] = (unsigned char)options->topology;
    more[4] = (unsigned char)options->exchange;
    jl_put_u32(more + 5, (jl_u32)options->gate_most);
    jl_put_real(more + 9, options_gate(options, model->m));
    return jl_crc32(crc, more, sizeof more);
}

/* "PE0: no word from PE2: nothing happened before the deadline" */
static void pe_failed(int pe, const jl_par *par, int status)
{
    char name[16], other[16] = "the host";

    snprintf(name, sizeof name, "PE%d", pe);
    if (par->failed == JL_OK) {
        complain(name, 0, NULL, "%s", jl_status_text(status));
        return;
    }
    if (par->failed_pe == pe)
        strcpy(other, "the others");
    else if (par->failed_pe < par->config.npe)
        snprintf(other, sizeof other, "PE%d", par->failed_pe);
    complain(name, 0, NULL, "%s %s: %s", par->failed == JL_EMODEL
             ? "not like" : par->failed_pe == pe
             ? "given up by" : "no word from", other, jl_status_text(status));
}

int run_pe(int pe, const struct model *model, const struct options *options,
           jl_chan **to, jl_chan **from)
{
    int M = model->M, cap = 2 * run_max_len(model), status;
    unsigned char *owner = calloc((size_t)M, 1);
    unsigned char *buf = malloc((size_t)cap);
    int *mode_status = calloc((size_t)M, sizeof *mode_status);
    jl_real *z = calloc((size_t)model->m, sizeof *z);
    jl_par_config config;
    struct bank bank;
    jl_par par = { .failed = JL_OK };   /* also if its init refuses */

    if (owner == NULL || buf == NULL || mode_status == NULL || z == NULL
        || bank_open(&bank, model, options) != 0) {
        complain(model->path, 0, NULL, "no memory for its filter");
        status = JL_ENOMEM;
    } else {
        jl_par_deal(owner, M, options->pes);
        memset(&config, 0, sizeof config);
        config.pe = pe;
        config.npe = options->pes;
        config.owner = owner;
        config.topology = options->topology;
        config.exchange = options->exchange;
        config.to = to;
        config.from = from;
        config.to_host = to[options->pes];
        config.from_host = from[options->pes];
        config.prepare = bank_prepare;
        config.prepare_cg = bank_prepare_cg;
        config.context = &bank;
        config.fingerprint = run_fingerprint(model, options);
        config.start_us = options->start_us;
        config.timeout_us = run_message_us(options);
        status = model->gains != NULL
            ? jl_par_init_cg(&par, &bank.cg, &config, buf, cap, mode_status, z)
            : jl_par_init(&par, &bank.imm, &config, buf, cap, mode_status, z);
        if (status == JL_OK)
            status = jl_par_serve(&par, bank.scratch);
        if (status != JL_OK)
            pe_failed(pe, &par, status);
        bank_close(&bank);
    }
    free(owner);
    free(buf);
    free(mode_status);
    free(z);
    return status;
}
