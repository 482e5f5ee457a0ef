# SPDX-License-Identifier: Apache-2.0
"""Puts scans into the folder of a live session one by one; prints the seconds until a state tells the verdict."""
import json, os, shutil, statistics, subprocess, sys, time

program, scenes, watched, session, points = sys.argv[1:6]
live = subprocess.Popen(
    [program, "live", f"{scenes}/model.ply", "--watch", watched, "-o", session, "--port", "0", "--json", "--no-result",
     "--idle", "3600"],
    stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
states = map(json.loads, live.stdout)
first_times, final_times, cpu_times = [], [], []


def cpu_seconds():  # of the session, all threads: what says something on a machine that has other things to do, too
    with open(f"/proc/{live.pid}/stat") as stat:
        user, system = stat.read().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def wait(wanted):
    for state in states:
        if wanted(state):
            return time.monotonic(), state
    sys.exit("the session ended before it told")


wait(lambda state: state["watch"])
for name in sorted(n for n in os.listdir(scenes) if n.startswith("scan_") and n.endswith(".ply")):
    shutil.copy(f"{scenes}/{name}", f"{watched}/.coming")
    begin, cpu_begin = time.monotonic(), cpu_seconds()
    os.rename(f"{watched}/.coming", f"{watched}/{name}")
    told, state = wait(lambda state: any(s["file"] == name for s in state["scans"]))
    first_times.append(told - begin)
    if any(s["file"] == name and s["provisional"] for s in state["scans"]):
        told, state = wait(lambda state: any(s["file"] == name and not s["provisional"] for s in state["scans"]))
    final_times.append(told - begin)
    cpu_times.append(cpu_seconds() - cpu_begin)
    time.sleep(0.5)  # the sensor's limits are learnt after the answer
live.kill()
load = os.getloadavg()[0]
print(f"{points} points: told after {statistics.median(first_times):.2f} s, confirmed after "
      f"{statistics.median(final_times):.2f} s, {statistics.median(cpu_times):.2f} s of CPU "
      f"(median of {len(first_times)}, load {load:.1f})")
