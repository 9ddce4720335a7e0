/* The joint gate: a measurement is rejected only when every mode rejects it. */
#include "imm/imm_stage.h"

int jl_imm_gate(jl_imm *imm, jl_real nis, int most)
{
    if (!(nis >= 0 && nis <= JL_REAL_MAX) || most < 0)
        return JL_ERANGE;
    imm->gate = nis;
    imm->most = most;
    imm->stage = JLI_IDLE;
    return JL_OK;
}

static int rejects(const jl_imm *imm, int j)
{
    return imm->gate > 0 && imm->nis[j] > imm->gate;
}

static int waits(const jl_imm *imm, int j)
{
    return rejects(imm, j) || (imm->gate > 0 && !jli_is_possible(imm, j));
}

/* Every mode that is possible rejects, and not too often in a row, unless one
 * of them cannot use the measurement: its likelihood is 0. */
static int all_reject(const jl_imm *imm)
{
    int j, unusable = 0;

    for (j = 0; j < imm->M; j++)
        if (jli_is_possible(imm, j)) {
            if (!rejects(imm, j))
                return 0;
            unusable |= imm->l[j] < -JL_REAL_MAX;
        }
    return unusable || imm->run < imm->most;
}

int jl_imm_judge(jl_imm *imm, const jl_real *z, jl_real *scratch)
{
    int j, status = JL_OK;

    if (imm->stage != JLI_FILTERED)
        return JL_EORDER;
    imm->stage = JLI_JUDGED;
    if (z != NULL && !(imm->gate > 0)) {
        imm->verdict = JL_ACCEPTED;
        return JL_OK;
    }
    imm->verdict = z == NULL ? JL_MISSING
        : all_reject(imm) ? JL_REJECTED : JL_ACCEPTED;
    for (j = 0; j < imm->M && status == JL_OK; j++) {
        if (imm->verdict != JL_ACCEPTED)
            imm->l[j] = 0;
        else if (waits(imm, j))
            status = jli_imm_update(imm, j, z, 0, scratch);
    }
    return status;
}
