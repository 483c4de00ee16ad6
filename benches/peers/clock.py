"""Median thread CPU time of a call, and the line that every script prints."""

import statistics
import time


def median_ns(call, budget=1.0, least=5, most=200):
    """Median of the thread CPU time of one call [ns]. Samples of 0.2 ms at least; about `budget` seconds in all."""
    call()
    begin = time.thread_time_ns()
    call()
    once = max(time.thread_time_ns() - begin, 200)
    repeat = max(1, int(2e5 / once))
    samples = min(most, max(least, int(budget * 1e9 / (once * repeat))))
    times = []
    for _ in range(samples):
        begin = time.thread_time_ns()
        for _ in range(repeat):
            call()
        times.append((time.thread_time_ns() - begin) / repeat)
    return statistics.median(times)


def line(name, drawing, nanoseconds):
    """`name,topology,count,ns_per_body_or_loop`"""
    print(f"{name},{drawing.label},{drawing.count},{nanoseconds / drawing.per:.1f}", flush=True)
