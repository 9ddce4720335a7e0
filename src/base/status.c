#include "jumplink/base.h"

const char *jl_status_text(int status)
{
    switch (status) {
    case JL_OK:
        return "success";
    case JL_EDIM:
        return "size out of range, or sizes that do not fit";
    case JL_ENOMEM:
        return "array too small";
    case JL_ENONFINITE:
        return "number not finite or too large";
    case JL_EASYM:
        return "covariance not symmetric";
    case JL_EDEF:
        return "covariance not positive definite or semidefinite";
    case JL_EPROB:
        return "probabilities negative or not summing to 1";
    case JL_ESINGULAR:
        return "innovation covariance S is not positive definite";
    case JL_ERANGE:
        return "argument outside the function's domain";
    case JL_EORDER:
        return "call out of order";
    case JL_ETIME:
        return "time goes back";
    case JL_ETIMEOUT:
        return "deadline passed";
    case JL_ECLOSED:
        return "channel closed by the other end";
    case JL_ETOOLONG:
        return "message too long for the channel or the buffer";
    case JL_EDEADLOCK:
        return "deadlock: everybody waits for everybody";
    case JL_EPEER:
        return "the other end restarted, or is not who it was";
    case JL_EIO:
        return "carrier failed";
    case JL_EAGAIN:
        return "nothing there yet, or no room yet: try again later";
    case JL_EMAGIC:
        return "not a frame";
    case JL_EVERSION:
        return "frame of another version";
    case JL_ENUMBER:
        return "frame with numbers of another type";
    case JL_ELENGTH:
        return "frame or message of the wrong length";
    case JL_ECRC:
        return "frame damaged on its way";
    case JL_EMSG:
        return "message that does not belong here";
    case JL_EMODEL:
        return "the PEs have different models, filters, forms, gates or "
               "topologies";
    case JL_ESILENT:
        return "nothing heard from the other end for too long";
    case JL_ECHAIN:
        return "the chain is not diag(lambda) + 1 v', which an all-reduce "
               "needs";
    case JL_EGATE:
        return "a gate, which an all-reduce cannot serve";
    default:
        return "unknown status";
    }
}
