/* Whether the other end is still heard. */
#include "link/link_parts.h"

/* Time since the last judging counts only up to a bound, so that time spent
 * elsewhere, however long, is never enough to condemn. */
int jl_link_judge(jl_link *link, jl_u32 now)
{
    jl_u32 passed = jli_ahead(now, link->listened_at);

    if (jli_ahead(now, link->heard_at) > (jl_u32)JL_LINK_MAX_US)
        link->heard_at = jli_ahead(now, (jl_u32)JL_LINK_MAX_US);
    if (!jli_listens(link))
        return link->failed == JL_ESILENT ? JL_ESILENT : JL_OK;
    link->unheard_us += passed < jli_listen_us(link) ? passed
                                                     : jli_listen_us(link);
    link->listened_at = now;
    if (link->unheard_us < link->config.silence_us)
        return JL_OK;
    link->up = 0;
    link->failed = JL_ESILENT;
    return JL_ESILENT;
}

long jl_link_silence(const jl_link *link, jl_u32 now)
{
    jl_u32 unheard = jli_ahead(now, link->heard_at);

    if (link->failed != JL_ESILENT && (!link->up || link->failed != JL_OK))
        return -1;
    return unheard < (jl_u32)JL_LINK_MAX_US ? (long)unheard : JL_LINK_MAX_US;
}
