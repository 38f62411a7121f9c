"""For the Python that has rerun-sdk: `log_rerun.py LOG.mcap OUT.npz` saves every field that Rerun reads from a log."""

import sys

import numpy as np
from rerun.chunk import McapReader

found: dict[str, list[np.ndarray]] = {}
for chunk in McapReader(sys.argv[1], timeline_type="duration", decoders=["protobuf"]).stream():
    batch = chunk.to_record_batch()
    (name,) = (n for n in batch.schema.names if n.endswith(":message"))
    times = batch.column("message_log_time").cast("int64").to_numpy()
    found.setdefault(f"{chunk.entity_path} time", []).append(times)
    messages = batch.column(name).values
    for field in messages.type:
        values = messages.field(field.name).to_numpy(zero_copy_only=False)
        found.setdefault(f"{chunk.entity_path} {field.name}", []).append(values)
np.savez(sys.argv[2], **{key: np.concatenate(parts) for key, parts in found.items()})
