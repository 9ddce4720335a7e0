/* Pieces, acknowledgements and closing of a link (src/link/link.c, link_in.c,
 * link_out.c) between two ends that are up, for the model checker spin.
 * Sessions are in link_session.pml; check_link_model.sh runs both.
 *
 * What is left out, and why what holds here holds there:
 *  - Time.  A timer may expire at any moment, so also at the right one; what
 *    rto_us, ack_us and half a window decide is only when, and here it is any
 *    time.  So may a receiver ask for a missing piece whenever one comes ahead
 *    of it, or not: ask_for_missing() chooses, here both are tried.
 *  - Payloads, checksums.  A damaged frame is a lost one.  A piece carries, as
 *    what it means, its true number, which the code never sees.
 *  - Messages of several pieces.  The protocol looks at no kind but BYE; what
 *    a piece is in its message is the matter of fits() and of recv.
 *  - Numbers are modulo SEQ for 2^32.  A piece is one that we had if it is
 *    SEQ/2 or more ahead, so SEQ/2 must be more than the pieces that can be
 *    under way, W and BYE, and than the age in pieces of the oldest frame.
 *    With AGELESS frames that is all pieces; a carrier that keeps the order
 *    may see the numbers wrap.  (2^31 pieces are hours on any carrier.)
 *  - Two carriers.  One keeps the order, loses and doubles, and has room for
 *    C0 and C1 frames each way.  The other, AGELESS, brings any frame that can
 *    have been said so far, at any time, any number of times, or never: it can
 *    do more than any real one, and reaches more states.
 *  - Fairness.  Either carrier becomes calm some time, after as much mischief as
 *    there may be; then it keeps the order and loses nothing.  What must happen
 *    from every state so reached happens with certainty where each frame has a
 *    chance to arrive, since a finite run without loss suffices.
 */
#ifndef W
#define W 2                             /* link->window */
#endif
/* -DMUTANT=name: a protocol that is wrong in one way. */
#ifndef MUTANT
#define MUTANT 0
#endif
#define ANY_SEQ 1
#define ANY_ACK 2
#define ROOM_UNSEEN 3
#define ACK_BEFORE_ROOM 4
#define BYE_OVERTAKES 5
#define BYE_ENDS_ALL 6
#define NEVER_AGAIN 7
#define TWICE_UNSAID 8

#ifdef AGELESS
#define IN_ORDER false                  /* not before it is calm */
#else
#define IN_ORDER true
#endif

#define N(i) (i -> N1 : N0)             /* messages that end i sends */
#define AHEAD(a, b) (((a) + 256 * SEQ - (b)) % SEQ)     /* jli_ahead */

mtype = { PIECE, ACK, BYE };

typedef Link {                          /* jl_link; numbers do not wrap here */
    byte out_first, out_next, out_high, out_end;
    bool alone;                         /* wait_us != rto_us */
    bool closing;
    byte in_next, in_held;
    bool closed;                        /* failed == JL_ECLOSED */
    bool ack_due;                       /* ack_due > 0 || ack_now */
    bool room_lacked, ask_now;
    byte taken;                         /* pieces taken in truth */
    bool left                           /* its user saw all, and has gone */
};

Link E[2];
chan wire0 = [C0] of { mtype, byte, byte, byte };
chan wire1 = [C1] of { mtype, byte, byte, byte };   /* kind seq ack meaning */
chan wire[2];
bool calm;                              /* the carrier is perfect from now on */

#define HAS_PIECE(l) (l.out_next != l.out_end && \
                      (l.out_next == l.out_first || !l.alone))
#define HELD(l) (l.out_end - l.out_first)
#define IDLE(l) (!l.ack_due && (HELD(l) == 0 || \
    (l.closing && l.closed && l.out_high == l.out_end && \
     (HELD(l) == 1 || MUTANT == BYE_ENDS_ALL))))

inline take_ack(l, other)
{
    n = AHEAD(ack, l.out_first % SEQ);
    if
    :: n > l.out_high - l.out_first && MUTANT != ANY_ACK
                                        /* old, or of what was never sent */
    :: else ->
        if
        :: n > 0 ->
            if
            :: n > l.out_next - l.out_first -> l.out_next = l.out_first + n
            :: else
            fi;
            l.out_first = l.out_first + n;
            l.alone = false
        :: else
        fi;
        assert(l.out_first <= other.taken);     /* acknowledged: taken */
        if
        :: kind == ACK && seq == 1 -> l.out_next = l.out_first
        :: else
        fi
    fi
}

inline take_piece(l)
{
    n = (MUTANT == ANY_SEQ -> 0 : AHEAD(seq, l.in_next % SEQ));
    if
    :: n >= SEQ / 2 ->                  /* our acknowledgement was lost */
        l.ack_due = l.ack_due || MUTANT != TWICE_UNSAID
    :: n < SEQ / 2 && l.closed
    :: n < SEQ / 2 && !l.closed && l.in_held == W && kind != BYE &&
       MUTANT != ROOM_UNSEEN ->
        l.room_lacked = true;
        if
        :: n == 0 && MUTANT == ACK_BEFORE_ROOM ->
            l.in_next++;
            l.ack_due = true
        :: else
        fi
    :: else ->
        if
        :: n > 0 && !(kind == BYE && MUTANT == BYE_OVERTAKES) ->
            l.ask_now = l.ask_now || asks
        :: else ->
            assert(meaning == l.taken);         /* in order, once, none lost */
            l.taken++;
            if
            :: kind == BYE -> l.closed = true
            :: else -> l.in_held++; assert(l.in_held <= W)
            fi;
            l.in_next++;
            l.room_lacked = false;
            l.ack_due = true
        fi
    fi
}

inline input(i)
{
    if
    :: kind != ACK -> select(asks : 0 .. 1)
    :: else
    fi;
    d_step {
        take_ack(E[i], E[1 - i]);
        if
        :: kind != ACK -> take_piece(E[i])
        :: else
        fi;
        kind = 0; seq = 0; ack = 0; meaning = 0; n = 0; asks = 0
    }
}

/* jl_link_input */
proctype Input(bit i)
{
    mtype kind;
    byte seq, ack, meaning, n;
    bool asks;

end:
    do
    :: atomic {
#ifdef AGELESS
        !calm ->
        if
        :: kind = ACK;
            select(seq : 0 .. 1);
            select(ack : 0 .. E[1 - i].in_next)
        :: E[1 - i].out_high > 0 ->     /* its ack may come before it */
            select(meaning : 0 .. E[1 - i].out_high - 1);
            seq = meaning;
            kind = (meaning == N(1 - i) -> BYE : PIECE)
        fi;
        input(i) }
    :: atomic {
#endif
        nempty(wire[1 - i]) ->
        if
        :: wire[1 - i]?kind, seq, ack, meaning
        :: !calm -> wire[1 - i]?<kind, seq, ack, meaning>       /* doubled */
        fi;
        input(i) }
    od
}

/* jl_link_output: transmit or acknowledge; and the retransmission timer */
proctype Output(bit i)
{
    mtype kind;
    byte seq, meaning;

end:
    do
    :: atomic {
        (HAS_PIECE(E[i]) || E[i].ack_due || E[i].ask_now) &&
        (nfull(wire[i]) || !calm) ->
        d_step {
            if
            :: HAS_PIECE(E[i]) ->
                meaning = E[i].out_next;
                seq = meaning % SEQ;
                kind = (meaning == N(i) -> BYE : PIECE);
                E[i].out_next++;
                if
                :: E[i].out_high < E[i].out_next ->
                    E[i].out_high = E[i].out_next
                :: else
                fi
            :: else ->
                kind = ACK;
                seq = E[i].ask_now;
                E[i].ask_now = false
            fi;
            E[i].ack_due = false
        }
        if
        :: nfull(wire[i]) && (calm || IN_ORDER) ->
            wire[i]!kind, seq, E[i].in_next % SEQ, meaning
        :: !calm                        /* lost */
        fi;
        kind = 0; seq = 0; meaning = 0 }
    :: d_step {
        E[i].out_next != E[i].out_first && MUTANT != NEVER_AGAIN ->
        E[i].out_next = E[i].out_first;
        E[i].alone = true }
    od
}

/* jl_link_send, jl_link_close, jl_link_recv, jl_link_idle */
proctype User(bit i)
{
    do
    :: d_step {
        E[i].out_end < N(i) && HELD(E[i]) < W -> E[i].out_end++ }
    :: d_step {
        E[i].out_end == N(i) -> E[i].closing = true; E[i].out_end++ }
    :: d_step {
        E[i].in_held > 0 ->
        E[i].in_held--;
        if
        :: E[i].room_lacked && E[i].in_held <= W / 2 ->
            E[i].room_lacked = false; E[i].ask_now = true
        :: else
        fi }
    :: d_step {
        E[i].closing && E[i].closed && E[i].in_held == 0 && IDLE(E[i]) ->
        assert(E[i].taken == N(1 - i) + 1);     /* all of the other's */
        assert(E[1 - i].taken >= N(i));       /* all of ours, but BYE */
        E[i].left = true } ->
        break
    od
}

init {
    atomic {
        wire[0] = wire0; wire[1] = wire1;
        run Input(0); run Output(0); run User(0);
        run Input(1); run Output(1); run User(1)
    }
#ifdef FAIR
    calm = true                         /* at some time */
#endif
}

ltl delivered { <> (E[0].left && E[1].left) }
