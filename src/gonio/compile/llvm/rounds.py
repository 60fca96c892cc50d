"""Code by which helpers join and leave a kernel: a caller leads a round, helpers take seats (compile/workers.py)."""

from __future__ import annotations

import platform

# The team's memory, in 64-bit words, a line of the cache for each of three: whether a caller has it; the gate; the work
# (function, arguments, outer, inner, grain) and the address of sched_yield. The gate is the round times 2^32, plus the
# seats left for helpers times 2^16, plus the helpers inside. It changes at once, so nobody enters a round that is over.
WORDS, LINE, YIELD = 24, 64, 21

_WORK = (("function", "ptr"), ("args", "ptr"), ("outer", "i64"), ("inner", "i64"), ("grain", "i64"))

HELP = """
define i64 @kernel(ptr %team, i64 %last, i64 %looks) nounwind {
entry:
  %gate = getelementptr i64, ptr %team, i64 8
  br label %look
look:
  %seen = phi i64 [ %last, %entry ], [ %seen, %wait ], [ %seen, %join ], [ %round, %work ]
  %n = phi i64 [ 0, %entry ], [ %n.next, %wait ], [ %n, %join ], [ 0, %work ]
  %now = load atomic i64, ptr %gate monotonic, align 8
  %round = lshr i64 %now, 32
  %new = icmp ne i64 %round, %seen
  %seats = and i64 %now, 4294901760
  %free = icmp ne i64 %seats, 0
  %open = and i1 %new, %free
  br i1 %open, label %join, label %wait
join:
  %inside = sub i64 %now, 65535
  %tried = cmpxchg ptr %gate, i64 %now, i64 %inside acquire monotonic
  %joined = extractvalue { i64, i1 } %tried, 1
  br i1 %joined, label %work, label %look
work:
  LOADS
  call void %function(ptr %args, i64 %outer, i64 %inner, i64 %grain)
  %left = atomicrmw sub ptr %gate, i64 1 release
  br label %look
wait:
  PAUSE
  %n.next = add i64 %n, 1
  %more = icmp ult i64 %n.next, %looks
  br i1 %more, label %look, label %exit
exit:
  ret i64 %seen
}
"""
"""help(team, last round, looks): take part in every round after that one; the last round seen, after so many looks."""

LEAD = """
define void @kernel(ptr %team, i64 %seats, ptr %function, ptr %args, i64 %outer, i64 %inner, i64 %grain) nounwind {
entry:
  %tried = cmpxchg ptr %team, i64 0, i64 1 acquire monotonic
  %mine = extractvalue { i64, i1 } %tried, 1
  br i1 %mine, label %post, label %alone
alone:
  call void %function(ptr %args, i64 %outer, i64 %inner, i64 %grain)
  ret void
post:
  STORES
  %gate = getelementptr i64, ptr %team, i64 8
  %old = load atomic i64, ptr %gate monotonic, align 8
  %round = and i64 %old, -4294967296
  %next = add i64 %round, 4294967296
  %places = shl i64 %seats, 16
  %opened = or i64 %next, %places
  store atomic i64 %opened, ptr %gate release, align 8
  call void %function(ptr %args, i64 %outer, i64 %inner, i64 %grain)
  %closed = atomicrmw and ptr %gate, i64 -4294901761 acquire
  %yield.at = getelementptr i64, ptr %team, i64 21
  %yield = load ptr, ptr %yield.at, align 8
  br label %wait
wait:
  %n = phi i64 [ 0, %post ], [ %n.next, %pause ], [ 0, %sleep ]
  %now = load atomic i64, ptr %gate acquire, align 8
  %inside = and i64 %now, 65535
  %some = icmp ne i64 %inside, 0
  br i1 %some, label %patient, label %exit
patient:
  %n.next = add i64 %n, 1
  %quick = icmp ult i64 %n.next, 2000
  br i1 %quick, label %pause, label %sleep
pause:
  PAUSE
  br label %wait
sleep:
  %slept = call i32 %yield()
  br label %wait
exit:
  store atomic i64 0, ptr %team release, align 8
  ret void
}
"""
"""lead(team, seats, function, args, outer, inner, grain): the function, by the caller and by helpers in so many seats;
by the caller alone where another caller has the team."""


def complete(text: str) -> str:
    """The code with its repeated parts: the words of the work, and the pause of a thread that only looks."""
    at = [f"%{name}.at = getelementptr i64, ptr %team, i64 {word}" for word, (name, _) in enumerate(_WORK, 16)]
    loads = [f"%{name} = load {kind}, ptr %{name}.at, align 8" for name, kind in _WORK]
    stores = [f"store {kind} %{name}, ptr %{name}.at, align 8" for name, kind in _WORK]
    for place, lines in {"LOADS": loads, "STORES": stores}.items():
        text = text.replace(place, "\n  ".join(line for pair in zip(at, lines, strict=True) for line in pair))
    pause = "call void @llvm.x86.sse2.pause()" if platform.machine() in ("x86_64", "AMD64") else ""
    return text.replace("PAUSE", pause) + ("declare void @llvm.x86.sse2.pause()\n" if pause else "")
