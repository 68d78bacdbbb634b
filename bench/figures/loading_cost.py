"""CPU time and peak memory of `lucerna info` on the scenes that loading_scene.py wrote.

usage: loading_cost.py LUCERNA FOLDER TRIANGLES
"""
import glob
import os
import subprocess
import sys


def cost(command):
    """Seconds of CPU time, and the peak of resident memory in bytes."""
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        sys.exit("%s ended with %d" % (command[0], child.returncode))
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def main():
    lucerna, folder, triangles = sys.argv[1], sys.argv[2], int(sys.argv[3])
    text = os.path.getsize(os.path.join(folder, "text.pbrt"))
    ply = sum(os.path.getsize(name) for name in glob.glob(os.path.join(folder, "*.ply")))
    for name, bytes_read, share in (("text", text, 0.5), ("ply", ply, 0.5), ("both", text + ply, 1)):
        seconds, peak = cost([lucerna, "info", os.path.join(folder, name + ".pbrt")])
        count = share * triangles
        print("%-5s %5.1f million triangles, %4.0f MB: %6.2f s CPU with Embree's build, peak %5.0f MB, %4.0f bytes per triangle"
              % (name, count / 1e6, bytes_read / 1e6, seconds, peak / 1e6, peak / count), flush=True)


if __name__ == "__main__":
    main()
