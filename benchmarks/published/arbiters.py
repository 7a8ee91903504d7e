"""Arbiters of buses and buffers.

- `amba`: the arbiter of the AMBA AHB bus, specified by Bloem, Jobstmann, Piterman, Pnueli and
  Sa'ar (Synthesis of Reactive(1) Designs, JCSS 2012), with monitors for the properties that are
  not transitions.  Known as jcss12 in collections.
- `genbuf`: IBM's generalized buffer between many senders and two receivers (same source).
- `synt15`: the same arbiter as revised by Filippidis, Murray and Holzmann (A multi-paradigm
  language for reactive synthesis, SYNT 2015).
"""

from published.text import all_of, any_of, code, move, specification


def amba(masters: int = 4) -> str:
    """The AMBA AHB arbiter: which master gets the bus, with bursts and locked transfers."""
    if masters < 2:
        raise ValueError("a bus needs at least two masters")
    every = range(masters)
    bits = (masters - 1).bit_length()

    def owner(i: int, prime: str = "") -> str:
        return code("hmaster", bits, i, prime)

    single = "(!hburst0 & !hburst1)"  # a burst of unspecified length
    four = "(!hburst0 & hburst1)"  # a burst of four
    a1 = ("(!stateA1_1 & !stateA1_0)", "(stateA1_1 & !stateA1_0)", "(!stateA1_1 & stateA1_0)")
    a1_next = tuple(s.replace(")", "')").replace(" &", "' &") for s in a1)
    g3 = [code("stateG3_", 3, k) for k in range(5)]
    g3_next = [code("stateG3_", 3, k, "'") for k in range(5)]
    begins = f"(hmastlock & start & {four})"
    sys_trans = [f"{owner(i)} -> (hbusreq{i} <-> busreq)" for i in every]
    sys_trans += [  # the owner of a locked burst gives the bus up at some time (assumption 1)
        move(f"{a1[0]} & (!hmastlock | !{single})", a1_next[0]),
        move(f"{a1[0]} & hmastlock & {single}", a1_next[1]),
        move(f"{a1[1]} & busreq", a1_next[1]),
        move(f"{a1[1]} & !busreq & (!hmastlock | !{single})", a1_next[0]),
        move(f"{a1[1]} & !busreq & hmastlock & {single}", a1_next[2]),
        move(f"{a1[2]} & busreq", a1_next[1]),
        move(f"{a1[2]} & hmastlock & {single}", a1_next[1]),
        move(f"{a1[2]} & !busreq & (!hmastlock | !{single})", a1_next[0]),
        "!hready -> !start'",
    ]
    sys_trans += [  # a locked burst of unspecified length lasts until it is given up
        move(f"!stateG2 & (!hmastlock | !start | !{single})", "!stateG2'"),
        move(f"!stateG2 & hmastlock & start & {single}", "stateG2'"),
        move("stateG2 & !start & busreq", "stateG2'"),
        "!(stateG2 & start)",
        move("stateG2 & !start & !busreq", "!stateG2'"),
    ]
    sys_trans += [  # a locked burst of four lasts four transfers
        move(f"{g3[0]} & !{begins}", g3_next[0]),
        move(f"{g3[0]} & {begins} & !hready", g3_next[1]),
        move(f"{g3[0]} & {begins} & hready", g3_next[2]),
    ]
    for k in range(1, 5):
        sys_trans += [
            move(f"{g3[k]} & !start & !hready", g3_next[k]),
            move(f"{g3[k]} & !start & hready", g3_next[(k + 1) % 5]),
            f"!({g3[k]} & start)",
        ]
    sys_trans += [f"hready -> (hgrant{i} <-> {owner(i, chr(39))})" for i in every]
    sys_trans += ["hready -> (locked <-> hmastlock')"]
    sys_trans += [f"!start' -> ({owner(i)} <-> {owner(i, chr(39))})" for i in every]
    sys_trans += ["!start' -> (hmastlock <-> hmastlock')"]
    for i in every:
        sys_trans += [
            f"(decide & hlock{i} & hgrant{i}') -> locked'",
            f"(decide & !hlock{i} & hgrant{i}') -> !locked'",
        ]
    sys_trans += [f"!decide -> (hgrant{i} <-> hgrant{i}')" for i in every]
    sys_trans += ["!decide -> (locked <-> locked')"]
    for i in range(1, masters):  # no grant without a request
        idle = f"!hgrant{i} & !hbusreq{i}"
        sys_trans += [
            f"(!stateG10_{i} & !({idle})) -> !stateG10_{i}'",
            f"(!stateG10_{i} & {idle}) -> stateG10_{i}'",
            f"(stateG10_{i} & {idle}) -> stateG10_{i}'",
            f"!(stateG10_{i} & hgrant{i} & !hbusreq{i})",
            f"(stateG10_{i} & hbusreq{i}) -> !stateG10_{i}'",
        ]
    sys_trans += [f"(decide & {all_of([f'!hbusreq{i}' for i in every])}) -> hgrant0'"]
    monitors = ["stateA1_0", "stateA1_1", "stateG2", *(f"stateG3_{b}" for b in range(3))]
    monitors += [f"stateG10_{i}" for i in range(1, masters)]
    low = ["hmastlock", "locked", "busreq", *(f"hgrant{i}" for i in range(1, masters)), *monitors]
    inputs = ["hburst0", "hburst1", *(f"hbusreq{i}" for i in every), *(f"hlock{i}" for i in every)]
    return specification(
        f"AMBA AHB arbiter, {masters} masters",
        INPUT=[*inputs, "hready"],
        OUTPUT=[
            "busreq",
            "decide",
            *(f"hgrant{i}" for i in every),
            *(f"hmaster{b}" for b in range(bits)),
            "hmastlock",
            "locked",
            "start",
            *monitors,
        ],
        ENV_INIT=[f"!{name}" for name in [*inputs, "hready"]],
        SYS_INIT=[owner(0), "start", "decide", "hgrant0", *(f"!{name}" for name in low)],
        ENV_TRANS=[f"hlock{i} -> hbusreq{i}" for i in every],
        SYS_TRANS=sys_trans,
        ENV_LIVENESS=["!stateA1_1", "hready"],
        SYS_LIVENESS=["!stateG2", g3[0], *(f"{owner(i)} | !hbusreq{i}" for i in every)],
    )


def genbuf(senders: int = 4) -> str:
    """The generalized buffer: from many senders through a queue to two receivers, in turn."""
    if senders < 2:
        raise ValueError("a buffer needs at least two senders")
    every = range(senders)
    bits = (senders - 1).bit_length()
    env_trans = []
    for i in every:
        env_trans += [
            f"(StoB_REQ{i} & !BtoS_ACK{i}) -> StoB_REQ{i}'",
            f"BtoS_ACK{i} -> !StoB_REQ{i}'",
        ]
    for i in range(2):
        env_trans += [
            f"!BtoR_REQ{i} -> !RtoB_ACK{i}'",
            f"(BtoR_REQ{i} & RtoB_ACK{i}) -> RtoB_ACK{i}'",
        ]
    env_trans += [
        "(ENQ & !DEQ) -> !EMPTY'",
        "(DEQ & !ENQ) -> !FULL'",
        "(ENQ <-> DEQ) -> ((FULL <-> FULL') & (EMPTY <-> EMPTY'))",
    ]
    sys_trans = []
    for i in every:
        sys_trans += [
            f"(!StoB_REQ{i} & StoB_REQ{i}') -> !BtoS_ACK{i}'",
            f"(!BtoS_ACK{i} & !StoB_REQ{i}) -> !BtoS_ACK{i}'",
            f"(BtoS_ACK{i} & StoB_REQ{i}) -> BtoS_ACK{i}'",
            *(f"!BtoS_ACK{i} | !BtoS_ACK{k}" for k in range(i + 1, senders)),
        ]
    for i in range(2):
        sys_trans += [
            f"(BtoR_REQ{i} & !RtoB_ACK{i}) -> BtoR_REQ{i}'",
            *(["!BtoR_REQ0 | !BtoR_REQ1"] if i == 0 else []),
            f"RtoB_ACK{i} -> !BtoR_REQ{i}'",
        ]
    sys_trans += [  # never the same receiver twice in a row
        "(!stateG7_1 & !BtoR_REQ0 & BtoR_REQ1) -> (stateG7_1' & !stateG7_0')",
        "(stateG7_1 & BtoR_REQ0 & !BtoR_REQ1) -> (!stateG7_1' & !stateG7_0')",
        "(!stateG7_1 & !BtoR_REQ0 & !BtoR_REQ1) -> (!stateG7_1' & stateG7_0')",
        "(stateG7_1 & !BtoR_REQ0 & !BtoR_REQ1) -> (stateG7_1' & stateG7_0')",
        "(!stateG7_1 & !stateG7_0 & BtoR_REQ0 & !BtoR_REQ1) -> (!stateG7_1' & !stateG7_0')",
        "(stateG7_1 & !stateG7_0 & !BtoR_REQ0 & BtoR_REQ1) -> (stateG7_1' & !stateG7_0')",
        "!(!stateG7_1 & stateG7_0 & BtoR_REQ0)",
        "!(stateG7_1 & stateG7_0 & BtoR_REQ1)",
    ]
    for i in every:
        taken = f"(!BtoS_ACK{i} & BtoS_ACK{i}')"
        selected = code("SLC", bits, i, "'")
        sys_trans += [
            f"{taken} -> ENQ'",
            f"{taken} -> {selected}" if i == 0 else f"{taken} <-> {selected}",
        ]
    nothing_taken = all_of([f"(BtoS_ACK{i} | !BtoS_ACK{i}')" for i in every])
    given = [f"(RtoB_ACK{i} & !RtoB_ACK{i}')" for i in range(2)]
    sys_trans += [f"{nothing_taken} -> !ENQ'", *(f"{event} -> DEQ'" for event in given)]
    sys_trans += [
        f"!{any_of(given)} -> !DEQ'",
        "(FULL & !DEQ) -> !ENQ",
        "EMPTY -> !DEQ",
        "(!stateG12 & EMPTY) -> !stateG12'",  # what was queued leaves again
        "(!stateG12 & DEQ) -> !stateG12'",
        "(!stateG12 & !EMPTY & !DEQ) -> stateG12'",
        "(stateG12 & !DEQ) -> stateG12'",
        "(stateG12 & DEQ) -> !stateG12'",
    ]
    inputs = [*(f"StoB_REQ{i}" for i in every), "RtoB_ACK0", "RtoB_ACK1", "FULL", "EMPTY"]
    outputs = [*(f"BtoS_ACK{i}" for i in every), "BtoR_REQ0", "BtoR_REQ1", "stateG7_0", "stateG7_1"]
    outputs += ["ENQ", "DEQ", "stateG12", *(f"SLC{b}" for b in range(bits))]
    return specification(
        f"generalized buffer, {senders} senders",
        INPUT=inputs,
        OUTPUT=outputs,
        ENV_INIT=[name if name == "EMPTY" else f"!{name}" for name in inputs],
        SYS_INIT=[name if name == "stateG7_1" else f"!{name}" for name in outputs],
        ENV_TRANS=env_trans,
        SYS_TRANS=sys_trans,
        ENV_LIVENESS=[f"BtoR_REQ{i} <-> RtoB_ACK{i}" for i in range(2)],
        SYS_LIVENESS=[*(f"StoB_REQ{i} <-> BtoS_ACK{i}" for i in every), "!stateG12"],
    )


def synt15(masters: int = 4, coupled: bool = False) -> str:
    """The AMBA AHB arbiter as revised: fewer inputs, and processes in place of monitors.

    Two lock requests are left: that of the master which has been granted the bus, and that
    of the one which owns it.  Three processes handle locked bursts: the owner of one of
    unspecified length gives up its lock at some time, the arbiter holds the bus for it until then,
    and counts the transfers of a burst of four.  Each process has a place in its program and the
    number of the edge that it takes; see `bunny` for whose turn it is.

    The revision needs no assumption that a lock request comes with one for the bus.  `coupled`
    assumes it, of both, and grants only on request: a harder game, with the same verdict.
    """
    if masters < 2:
        raise ValueError("a bus needs at least two masters")
    every = range(masters)
    single, four, unspecified = 0, 1, 2
    begins = {burst: f"(lock & start & burst = {burst})" for burst in (four, unspecified)}
    requests = [f"request{i}" for i in every]
    inputs = ["ready", *requests, "grantee_locks", "master_locks", "withdrawing"]
    monitors = ["lock", "lockmemo", "decided", "holding", "counting"]
    others = ("another_of_theirs", "another_of_ours")

    def edges(name: str, *choices: str) -> str:
        return any_of([f"({name}' = {k} & {choice})" for k, choice in enumerate(choices)])

    def burst_lock(place: str) -> tuple[str, ...]:
        """A locked burst of unspecified length, from its beginning until it is given up."""
        return (
            f"!{place} & !{begins[unspecified]} & !{place}'",
            f"!{place} & {begins[unspecified]} & {place}'",
            f"{place} & master_locks' & {place}'",
            f"{place} & !master_locks' & !{place}'",
        )

    env_coupled = [
        f"({who} = {i} & {locks}') -> request{i}'"
        for i in every
        for who, locks in (("grant", "grantee_locks"), ("master", "master_locks"))
    ]
    sys_coupled = [
        *(f"(grant != {i} & grant' = {i}) -> request{i}'" for i in every if i > 0),
        "(decide & " + all_of([f"!{name}'" for name in requests]) + ") -> grant' = 0",
    ]
    return specification(
        f"AMBA AHB arbiter, revised, {masters} masters",
        INPUT=[*inputs, "burst:0...2", "withdraw_edge:0...3", *others],
        OUTPUT=[
            *(f"{name}:0...{masters - 1}" for name in ("master", "grant")),
            *("start", "decide", *monitors, "count:0...3", "hold_edge:0...3", "count_edge:0...3"),
        ],
        ENV_INIT=[*(f"!{name}" for name in inputs), f"burst = {single}"],
        SYS_INIT=[
            *("master = 0", "grant = 0", "start", "decide", "count = 0"),
            *(f"!{name}" for name in monitors),
        ],
        ENV_TRANS=[
            *(env_coupled if coupled else ()),
            "master = grant -> (master_locks' <-> grantee_locks')",
            edges("withdraw_edge", *burst_lock("withdrawing")),
            *(f"!{name}'" for name in others),
        ],
        SYS_TRANS=[
            "!ready -> !start'",
            "ready -> (master' = grant & (lock' <-> lockmemo'))",
            "!start' -> (master' = master & (lock' <-> lock))",
            "decided' <-> decide",
            "decided -> (lockmemo' <-> grantee_locks')",
            "!decided -> (lockmemo' <-> lockmemo)",
            "!decide -> grant' = grant",
            *(sys_coupled if coupled else ()),
            edges("hold_edge", *burst_lock("holding")),
            edges(
                "count_edge",
                f"!counting & !{begins[four]} & !counting' & count' = 0",
                f"!counting & {begins[four]} & counting' & (ready <-> count' = 1)"
                " & (!ready <-> count' = 0)",
                "counting & !(ready & count = 3) & counting' & (ready -> count' = count + 1)"
                " & (!ready -> count' = count)",
                "counting & ready & count = 3 & !counting' & count' = 0",
            ),
            "(holding' | counting') -> !start'",
        ],
        ENV_LIVENESS=["ready", "!withdrawing"],
        SYS_LIVENESS=[f"!request{i} | master = {i}" for i in every],
    )
