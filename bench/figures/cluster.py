# Measures one render on several nodes: what is shared, what every node repeats, and what is sent. A model is fitted to that and
# evaluated for larger clusters. Nodes are network namespaces of this machine with links of limited rate, which need root.
#   usage: cluster.py LUCERNA OUT_FOLDER DATA_FOLDER [--rate 1gbit] [--nodes 1,2,4,8]
# Each rank has one thread. Run nothing else meanwhile.
import json
import os
import subprocess
import sys
import time

from methods import option

JOBS = {
    "progressive": ("pbrt-v4/staircase2/scene-v4.pbrt", ["--integrator", "progressive", "--passes", "8", "--set", "photons=400000"]),
    "photonmap": ("pbrt-v4/staircase2/scene-v4.pbrt", ["--integrator", "photonmap", "--set", "photons=1000000", "--spp", "8"]),
    "path": ("pbrt-v4/staircase2/scene-v4.pbrt", ["--integrator", "path", "--spp", "32"]),
}
SIZE = (384, 384)
NET = "10.77.0"
# The nodes of the modelled clusters: threads, bytes per second, seconds per message.
NODE = {"threads": 32, "bandwidth": 10e9 / 8, "latency": 20e-6}


def sh(command):
    subprocess.run(command, shell=True, check=True)


class Network:
    """So many namespaces over one bridge, each behind a link of that rate; an agent that starts commands in them as ssh would."""

    def __init__(self, nodes, rate, folder):
        self.nodes, self.rate, self.folder = nodes, rate, folder

    def __enter__(self):
        self.clear()
        sh(f"ip link add lubr type bridge; ip addr add {NET}.254/24 dev lubr; ip link set lubr up")
        for k in range(1, self.nodes + 1):
            sh(f"ip netns add lu{k}; ip link add v{k} type veth peer name eth0 netns lu{k}; ip link set v{k} master lubr up;"
               f"ip -n lu{k} addr add {NET}.{k}/24 dev eth0; ip -n lu{k} link set eth0 up; ip -n lu{k} link set lo up;"
               f"tc qdisc add dev v{k} root tbf rate {self.rate} burst 1mb latency 50ms;"
               f"tc -n lu{k} qdisc add dev eth0 root tbf rate {self.rate} burst 1mb latency 50ms")
        self.agent = os.path.join(self.folder, "agent.sh")
        os.makedirs(os.path.join(self.folder, "tmp"), exist_ok=True)
        with open(self.agent, "w") as file:
            file.write('#!/bin/bash\nhost=$1; shift; k=${host##*.}\nexec ip netns exec lu$k unshare --uts --mount bash -c '
                       f'"hostname node$k; mount -t tmpfs none {self.folder}/tmp; $*"\n')
        os.chmod(self.agent, 0o755)
        return self

    def __exit__(self, *_):
        self.clear()

    @staticmethod
    def clear():
        listed = subprocess.run("ip netns list", shell=True, capture_output=True, text=True).stdout
        for word in listed.split():
            if word.startswith("lu"):
                sh(f"ip netns del {word}")
        subprocess.run("ip link del lubr 2>/dev/null", shell=True)

    def launcher(self):
        hosts = ",".join(f"{NET}.{k}:1" for k in range(1, self.nodes + 1))
        return ["mpirun", "--mca", "plm", "rsh", "--mca", "plm_rsh_agent", self.agent, "--mca", "plm_rsh_no_tree_spawn", "1",
                "--mca", "oob_tcp_if_include", f"{NET}.0/24", "--mca", "btl", "tcp,self", "--mca", "btl_tcp_if_include",
                f"{NET}.0/24", "--host", hosts, "--bind-to", "none", "-n", str(self.nodes)]


class Measured:
    def __init__(self, lucerna, out, data, rate):
        self.lucerna, self.out, self.data, self.rate = os.path.abspath(lucerna), os.path.abspath(out), os.path.abspath(data), rate
        os.makedirs(self.out, exist_ok=True)

    def run(self, name, scene, words, nodes, size=SIZE, threads=1):
        """Statistics of a render on so many nodes; 0: without MPI."""
        stats = f"{self.out}/{name}-{nodes}.json"
        command = [self.lucerna, "render", os.path.join(self.data, scene), "--resolution", f"{size[0]}x{size[1]}", "--quiet", "--threads",
                   str(threads), "-o", f"{self.out}/{name}-{nodes}.exr", "--stats", stats, *words]
        environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMP_WAIT_POLICY="passive")
        begin = time.time()
        if nodes == 0:
            subprocess.run(command, check=True, env=environment, stderr=subprocess.DEVNULL)
        else:
            with Network(nodes, self.rate, self.out) as network:
                begin = time.time()
                subprocess.run([*network.launcher(), *command], check=True, env=environment, stderr=subprocess.DEVNULL)
        seconds = time.time() - begin
        with open(stats) as file:
            result = json.load(file)
        result["wall"] = seconds
        return result


def of_ranks(stats, phase):
    return [rank["processor_seconds"][phase] for rank in stats["ranks"]]


def traffic(stats, *but):
    return sum(t["bytes"] for what, t in stats["traffic"].items() if what not in but)


def transfer_seconds(stats):
    return sum(t["seconds"] for t in stats["traffic"].values())


def fitted(points):
    """a, b of a + b / n, by least squares, of [(n, value)]; neither below 0."""
    count = len(points)
    if count == 1:
        return 0.0, points[0][1]
    x = [1 / n for n, _ in points]
    y = [value for _, value in points]
    mean_x, mean_y = sum(x) / count, sum(y) / count
    b = sum((p - mean_x) * (q - mean_y) for p, q in zip(x, y)) / sum((p - mean_x) ** 2 for p in x)
    b = min(max(b, 0.0), max(y))
    return max(mean_y - b * mean_x, 0.0), b


def main():
    words = sys.argv[1:]
    rate, nodes = option(words, "--rate", "1gbit"), [int(n) for n in option(words, "--nodes", "1,2,4,8").split(",")]
    measured = Measured(*words[:3], rate)
    cores = os.cpu_count()
    costs = {}
    for name, (scene, options) in JOBS.items():
        print(f"\n{name}: {' '.join(options)}, {SIZE[0]} x {SIZE[1]}, links of {rate}\n")
        alone = measured.run(name, scene, options, 0, threads=1)
        both = measured.run(f"{name}-both", scene, options, 0, threads=cores)
        print(f"one process of 1 thread: prepare {alone['seconds']['prepare']:.2f} s, image {alone['seconds']['image']:.2f} s; of {cores}: "
              f"{both['seconds']['prepare']:.2f} s, {both['seconds']['image']:.2f} s\n")
        print("| nodes | prepare, each | image, all | sent: preparing, image | transfers | image s | prepare s | model: image | prepare |")
        print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
        runs = {n: measured.run(name, scene, options, n) for n in nodes if n > 1}
        runs_of_one = {"ranks": [{"processor_seconds": {"prepare": alone["seconds"]["prepare"] + alone["seconds"]["features"], "image": alone["seconds"]["image"]}}]}
        a, b = fitted([(1, alone["seconds"]["prepare"] + alone["seconds"]["features"])] + [(n, sum(of_ranks(r, "prepare")) / n) for n, r in runs.items()])
        image = alone["seconds"]["image"]
        for n, stats in [(1, runs_of_one), *runs.items()]:
            prepare, all_image = of_ranks(stats, "prepare"), sum(of_ranks(stats, "image"))
            if n == 1:
                print(f"| 1 | {prepare[0]:.2f} s | {all_image:.2f} s | | | {alone['seconds']['image']:.2f} | {alone['seconds']['prepare']:.2f} "
                      f"| {image:.2f} | {a + b:.2f} |")
                continue
            busy = min(n, cores)
            for_image = sum(stats["traffic"].get(what, {"bytes": 0})["bytes"] for what in ("image", "allocation", "items moved", "items left", "balance"))
            sent = traffic(stats) - for_image
            bandwidth = {"gbit": 1e9, "mbit": 1e6}[rate[-4:]] / 8 * float(rate[:-4])
            model_prepare = (n * a + b) / busy + sent * (n - 1) / n / bandwidth
            print(f"| {n} | {sum(prepare) / n:.2f} s | {all_image:.2f} s | {sent / 1e6:.1f} MB, {for_image / 1e6:.1f} MB | "
                  f"{transfer_seconds(stats):.2f} s | {stats['seconds']['image']:.2f} | {stats['seconds']['prepare']:.2f} | "
                  f"{image / busy + for_image / bandwidth:.2f} | {model_prepare:.2f} |", flush=True)
        last = runs[max(runs)]
        paths = last["numbers"].get("paths.emitted", 0)
        pixels = SIZE[0] * SIZE[1]
        passes = last["numbers"].get("passes", 0) or 1
        costs[name] = {
            "again": a, "shared": b, "paths": paths, "passes": passes, "image": image,
            "samples": pixels * last["samples"]["done"], "bytes": traffic(last, "image", "allocation", "items moved", "items left", "balance"),
            "bytes_of_pixel": last["traffic"]["image"]["bytes"] / pixels,
        }
    # The cost of a synchronisation of all ranks is measured by passes that contain nothing else.
    tiny = ["--integrator", "progressive", "--passes", "200", "--set", "photons=100", "--set", "prepass=0"]
    scene = JOBS["progressive"][0]
    one, two = measured.run("tiny", scene, tiny, 0, (16, 16)), measured.run("tiny", scene, tiny, 2, (16, 16))
    seconds = [r["seconds"]["features"] + r["seconds"]["prepare"] + r["seconds"]["image"] for r in (one, two)]
    meeting = max(seconds[1] - seconds[0], 0) / 200
    print(f"\na pass of nothing: {1e3 * seconds[0] / 200:.2f} ms alone, {1e3 * seconds[1] / 200:.2f} ms on two nodes")
    costs["pass"] = meeting
    # The work of rank 0 at the end is measured per pixel.
    large = measured.run("end", scene, ["--integrator", "direct", "--spp", "2", "--denoise"], 0, (1920, 1080), cores)
    took, area = large["seconds"], 1920 * 1080
    costs["denoise"] = took["denoise"] * cores / area
    costs["end"] = (large["wall"] - took["read"] - took["features"] - took["prepare"] - took["image"] - took["denoise"]) / area
    print(f"at the end, for each pixel: denoising {1e6 * costs['denoise']:.1f} us of one processor, all else {1e6 * costs['end']:.2f} us of rank 0")
    with open(f"{measured.out}/costs.json", "w") as file:
        json.dump(costs, file, indent=1)
    predict(costs)


def predict(costs):
    """A typical job on larger clusters: 10^8 light paths, 3840 x 2160 pixels, 256 passes or samples."""
    pixels, paths, rounds = 3840 * 2160, 1e8, 256
    threads, bandwidth = NODE["threads"], NODE["bandwidth"]
    print(f"\n3840 x 2160, 10^8 light paths, {rounds} passes or samples; nodes of {threads} threads, {8 * bandwidth / 1e9:.0f} Gb/s\n")
    print("| method | nodes | shared s | again s | travels s | meetings s | image s | at rank 0 s | all s | efficiency: image | whole |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name in JOBS:
        cost = costs[name]
        scale = paths / cost["paths"] if cost["paths"] else pixels / (SIZE[0] * SIZE[1])
        samples = pixels * rounds * (4 if name == "progressive" else 1)
        whole_of_one = None
        for n in (1, 8, 64, 1000):
            shared, again = cost["shared"] * scale / (threads * n), cost["again"] * scale / threads
            travels = cost["bytes"] * scale * (n - 1) / n / bandwidth
            meetings = 0 if n == 1 else costs["pass"] * (rounds if name == "progressive" else rounds / 16)
            image = cost["image"] / cost["samples"] * samples / (threads * n)
            # A round ends when its last tile does; the film is gathered once.
            last_tile = image / rounds * 16 / (pixels / 256 / (threads * n)) / 2
            image_phase = image + meetings + last_tile
            at_end = (0 if n == 1 else cost["bytes_of_pixel"] * pixels / bandwidth) + pixels * (costs["denoise"] / threads + costs["end"])
            whole = shared + again + travels + image_phase + at_end
            if n == 1:
                of_one, whole_of_one = image_phase, whole
            print(f"| {name} | {n} | {shared:.1f} | {again:.1f} | {travels:.1f} | {meetings:.1f} | {image:.1f} | {at_end:.1f} | {whole:.1f} | "
                  f"{of_one / (n * image_phase):.2f} | {whole_of_one / (n * whole):.2f} |")


if __name__ == "__main__":
    main()
