/* The joint gate: a measurement is rejected only when every mode rejects it. */
#include "imm/imm_stage.h"

int jl_imm_gate(jl_imm *imm, jl_real nis, int most)
{
    if (!(nis >= 0 && nis <= JL_REAL_MAX) || most < 0)
        return JL_ERANGE;
    imm->gate = nis;
    imm->most = most;
    return JL_OK;
}

static int rejects(const jl_imm *imm, int j)
{
    return imm->gate > 0 && imm->nis[j] > imm->gate;
}

/* Every mode that is possible rejects, and not too often in a row. */
static int all_reject(const jl_imm *imm)
{
    int j;

    for (j = 0; j < imm->M; j++)
        if (imm->logc[j] >= -JL_REAL_MAX && !rejects(imm, j))
            return 0;
    return imm->run < imm->most;
}

int jl_imm_judge(jl_imm *imm, const jl_real *z, jl_real *scratch)
{
    int j, status = JL_OK;

    if (imm->stage != JLI_FILTERED)
        return JL_EORDER;
    imm->stage = JLI_JUDGED;
    imm->verdict = z == NULL ? JLI_MISSING
        : all_reject(imm) ? JLI_REJECTED : JLI_ACCEPTED;
    for (j = 0; j < imm->M && status == JL_OK; j++) {
        if (imm->verdict != JLI_ACCEPTED)
            imm->l[j] = 0;
        else if (rejects(imm, j))
            status = jli_imm_update(imm, j, z, 0, scratch);
    }
    return status;
}
