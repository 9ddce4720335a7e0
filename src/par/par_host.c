/* The host's side of a run. */
#include "par/par_msg.h"

int jl_host_ready(jl_chan *from_pe0, jl_u32 fingerprint, int *failed_pe,
                  unsigned char *buf, int cap, long timeout_us)
{
    int len = jl_chan_recv(from_pe0, buf, cap, timeout_us), status;

    *failed_pe = -1;
    if (len < 0)
        return len;
    if (jli_msg_fault_read(failed_pe, &status, JL_MAX_PES, buf, len) == JL_OK)
        return status;
    if (len != JLI_MSG_HEADER || buf[0] != JLI_READY)
        return JL_EMSG;
    if (jl_get_u32(buf + 4) == fingerprint)
        return JL_OK;
    *failed_pe = buf[1];
    return JL_EMODEL;
}

int jl_host_send(jl_chan *to_pe0, const jl_meas *meas, int m,
                 unsigned char *buf, int cap, long timeout_us)
{
    if (cap < JL_PAR_MSG(1, 1, m))
        return JL_ENOMEM;
    return jl_chan_send(to_pe0, buf, jli_msg_meas(buf, meas, m), timeout_us);
}

int jl_host_recv(jl_chan *from_pe0, jl_estimate *estimate, int M, int n,
                 unsigned char *buf, int cap, long timeout_us)
{
    int len = jl_chan_recv(from_pe0, buf, cap, timeout_us), status;

    estimate->failed_pe = -1;
    if (len < 0)
        return len;
    if (jli_msg_fault_read(&estimate->failed_pe, &status, JL_MAX_PES, buf,
                           len) == JL_OK)
        return status;
    return jli_msg_estimate_read(estimate, M, n, buf, len);
}

int jl_host_stop(jl_chan *to_pe0, unsigned char *buf, int cap,
                 long timeout_us)
{
    if (cap < JLI_MSG_HEADER)
        return JL_ENOMEM;
    return jl_chan_send(to_pe0, buf, jli_msg_plain(buf, JLI_STOP, 0, 0, 0),
                        timeout_us);
}
