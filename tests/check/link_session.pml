/* Sessions of a link (src/link/link_in.c, link_out.c, "How a link comes up"
 * and "How a restart is seen" in src/wire/WIRE.md) for the model checker spin:
 * ends that start again, over a carrier that may bring any frame of any time.
 * What is said within a session is in link_transfer.pml.
 *
 * What is left out, and why what holds here holds there:
 *  - Time.  HELLO is repeated, and an end that is up talks, at any moment.
 *    Silence is found at any moment, right or wrong, while the carrier is bad;
 *    when it is calm, of an end that does not talk.
 *  - DATA, LAST, ACK and BYE are one kind, TALK: take_ack and take_piece see
 *    them only after all that decides here.
 *  - Sessions are 1, 2, 3 for the starts of a program.  The code compares them
 *    only for equality; that none returns is what link.h demands.
 *  - Of a frame's peer counts only whether it is the hearer's session, as in
 *    jl_link_input.  Frames that know the hearer are remembered until it starts
 *    again, when they become frames that do not; and those the carrier may
 *    bring even if they were never said.
 *  - The carrier may bring any frame ever said at any time, often, never: it
 *    loses, doubles, delays and replays without bound.  Some time it becomes
 *    calm: nobody starts again, no old frame comes, each new one arrives.  What
 *    must happen from every state once it is calm happens with certainty where
 *    there is any chance that it stays calm for a while.
 */
/* -DL0, -DL1: the most starts of each end. */
/* -DMUTANT=name: a protocol that is wrong in one way. */
#ifndef MUTANT
#define MUTANT 0
#endif
#define UP_BY_HELLO 1
#define HELLO_UNANSWERED 2
#define HELLO_BELIEVED 3
#define NEVER_DOUBTS 4
#define DOUBT_UNANSWERED 5
#define ALIVE_NOT_FOR_US 6
#define ANY_SESSION 7
#define MISTAKE_UNTOLD 8

#define HELLO 0
#define TALK 1
#define DOUBT 2
#define ALIVE 3

typedef Link {                          /* jl_link */
    byte me, peer;                      /* config.session, peer */
    bool up, failed;                    /* failed == JL_EPEER */
    bool ack_now;
    byte doubt, alive;
    byte born                           /* the other's session when we began */
};

Link E[2];
short said[2];          /* frames that know the end they are for, as bits */
#define BIT(kind, session) (1 << (4 * (session - 1) + kind))
chan box0 = [1] of { byte, byte, bool };
chan box1 = [1] of { byte, byte, bool };        /* kind session knows_us */
chan box[2];
bool calm;

/* Does an end that is up talk without being asked?  With BEATS it does, and
 * notices when the other does not; else only end 0 has something to send. */
#ifdef BEATS
#define TALKS(i) true
#else
#define TALKS(i) (i == 0)
#endif

inline fail(l)
{
    l.failed = true; l.up = false; l.peer = 0;
    l.ack_now = false; l.doubt = 0; l.alive = 0
}

inline meet_stranger(l, other)
{
    if
    :: (kind == ALIVE && (knows_us || MUTANT == ALIVE_NOT_FOR_US)) ||
       (kind == HELLO && MUTANT == HELLO_BELIEVED) ->
        assert(other.me > l.peer);      /* restarted: it really has */
        fail(l)
    :: (kind == HELLO || knows_us) && kind != ALIVE &&
       MUTANT != NEVER_DOUBTS && MUTANT != HELLO_BELIEVED ->
        l.doubt = session
    :: else
    fi
}

inline input(l, other)
{
    if
    :: l.failed
    :: !l.failed && kind == DOUBT && knows_us ->
        l.alive = (MUTANT == DOUBT_UNANSWERED -> 0 : session)
    :: !l.failed && !l.up && kind == HELLO && !knows_us &&
       MUTANT != UP_BY_HELLO ->
        l.peer = session                /* perhaps; the answer will show */
    :: !l.failed && !l.up && kind != HELLO && (!knows_us || kind == ALIVE)
    :: else ->
        if
        :: !l.up ->
            assert(session >= l.born);  /* up: it has lived while we did */
            l.peer = session;
            l.up = true
        :: else
        fi;
        if
        :: session != l.peer && MUTANT != ANY_SESSION ->
            meet_stranger(l, other)
        :: session == l.peer && kind == HELLO ->
            l.ack_now = l.ack_now || MUTANT != HELLO_UNANSWERED
        :: session == l.peer && kind != HELLO && !knows_us ->
            l.ack_now = l.ack_now || MUTANT != MISTAKE_UNTOLD
        :: else ->
            assert(kind != TALK || session == l.peer)   /* take_piece */
        fi
    fi
}

proctype Input(bit i)
{
    byte kind, session;
    bool knows_us;

end:
    do
    :: atomic {
        !calm ->                        /* any frame of any time */
        select(kind : 0 .. 3);
        select(session : 1 .. E[1 - i].me);
        select(knows_us : 0 .. 1);
        d_step {
            if
            :: !knows_us || (said[1 - i] & BIT(kind, session)) ->
                input(E[i], E[1 - i])
            :: else
            fi;
            kind = 0; session = 0; knows_us = false
        } }
    :: d_step {
        box[1 - i]?kind, session, knows_us ->
        input(E[i], E[1 - i]);
        kind = 0; session = 0; knows_us = false }
#ifdef BEATS
    :: d_step {                         /* jl_link_judge: silence */
        E[i].up && (!calm || E[1 - i].failed || E[1 - i].me != E[i].peer) ->
        fail(E[i]) }
#endif
    od
}

/* jl_link_output */
proctype Output(bit i)
{
    byte kind, peer;

end:
    do
    :: d_step {
        !E[i].failed && nfull(box[i]) &&
        (!E[i].up || E[i].alive || E[i].doubt || E[i].ack_now ||
         TALKS(i)) ->
        peer = E[i].peer;
        if
        :: E[i].alive != 0 -> kind = ALIVE; peer = E[i].alive; E[i].alive = 0
        :: E[i].alive == 0 && E[i].doubt != 0 ->
            kind = DOUBT; peer = E[i].doubt; E[i].doubt = 0
        :: E[i].alive == 0 && E[i].doubt == 0 && !E[i].up -> kind = HELLO
        :: else -> kind = TALK; E[i].ack_now = false
        fi;
        if
        :: calm -> box[i]!kind, E[i].me, (peer == E[1 - i].me)
        :: !calm && peer == E[1 - i].me ->
            said[i] = said[i] | BIT(kind, E[i].me)
        :: else
        fi;
        kind = 0; peer = 0 }
    od
}

inline start(i)
{
    E[i].me++; E[i].peer = 0; E[i].up = false; E[i].failed = false;
    E[i].ack_now = false; E[i].doubt = 0; E[i].alive = 0;
    E[i].born = E[1 - i].me;
    said[1 - i] = 0                     /* none of them knows this session */
}

proctype Host()
{
    do
    :: d_step { !calm && E[0].me < L0 -> start(0) }
    :: d_step { !calm && E[1].me < L1 -> start(1) }
    :: calm = true -> break
    od
}

init {
    atomic {
        box[0] = box0; box[1] = box1;
        E[0].me = 1; E[1].me = 1;
        run Input(0); run Output(0); run Input(1); run Output(1); run Host()
    }
}

#define LINKED (E[0].up && E[0].peer == E[1].me && \
                E[1].up && E[1].peer == E[0].me)
#define FAILED (E[0].failed || E[1].failed)
#ifdef BEATS
ltl agreed { <> [] (LINKED || (FAILED && !E[0].up && !E[1].up)) }
#else
ltl agreed { <> [] (LINKED || FAILED) }
#endif
