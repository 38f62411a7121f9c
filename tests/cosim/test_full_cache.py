"""A disk that fills while numba compiles the loop: the run goes on uncompiled, with the same results."""

import os
import subprocess
import sys

from ssp_writer import component, connection, system, write

RUN = """
import resource, signal, sys
from twip.cosim import Runtime, Table, load, simulate
with load(sys.argv[1], start_values={"a.u": 1.0}) as loaded:
    plain, table = Table(loaded.channels), Table(loaded.channels)
    simulate(loaded, sinks=plain, step_size=0.25, runtime=Runtime(loop="python"))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
    simulate(loaded, sinks=table, step_size=0.25, runtime=Runtime(loop="compiled"))
print((table.values == plain.values).all(), table["b.x"].tolist()[-1], [e.text for e in table.events])
"""


def test_a_disk_that_fills_while_the_loop_is_compiled_leaves_it_plain(folder, tmp_path):
    parts = [component("a", "CosimGain.fmu", "u> y<"), component("b", "CosimIntegrator.fmu", "u> x<")]
    path = write(folder, system(parts, [connection("a.y -> b.u")]))
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "numba")}
    words = [sys.executable, "-c", RUN, str(path)]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=300, check=False)
    told = ["the loop runs uncompiled: numba's cache cannot be written (File too large)"]
    assert (done.stdout, done.returncode) == (f"True 2.0 {told}\n", 0), done.stderr
