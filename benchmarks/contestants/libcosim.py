"""libcosim through libcosimpy, stepped in its own loop; its log is CSV."""

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from protocol import STEP_SIZE, arguments, serve, timed

log_output_level(CosimLogLevel.FATAL)
_, unpacked, logs = arguments()
execution = CosimExecution.from_ssp_file(ssp_path=str(unpacked), step_size=round(STEP_SIZE * 1e9))
if logs:
    observer = CosimObserver.create_to_dir(log_dir=str(logs))
    execution.add_observer(observer)
serve(lambda steps: timed(lambda: execution.step(step_count=steps)))
