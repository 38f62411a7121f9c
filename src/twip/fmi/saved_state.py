"""The saved state of a block instance: what it says about itself, and its bytes.

A state is a dictionary of numbers and text. JSON keeps it bit for bit: Python writes the shortest decimal that reads
back as the same float.
"""

import json
from typing import Any


def why_not_restorable(state: Any, block: str, fingerprint: str, size: int) -> str:
    """Return why `state` cannot be restored into a block with `size` values, or nothing when it can."""
    if not isinstance(state, dict) or "block" not in state:
        problem = state.get("problem", "") if isinstance(state, dict) else ""
        return f"what is to be restored into block {block} is not the state of a block{problem}"
    if state["block"] != block:
        return f"the state of block {state['block']} cannot be restored into block {block}"
    if state["fingerprint"] != fingerprint:
        return (
            f"the state of block {block} was saved by another build (fingerprint {state['fingerprint']}) "
            f"and cannot be restored into this one ({fingerprint})"
        )
    return "" if len(state["values"]) == size else f"the state of block {block} is incomplete"


def state_to_bytes(state: dict[str, Any]) -> bytes:
    """Return the bytes of a state."""
    return json.dumps(state).encode()


def state_from_bytes(data: bytes) -> dict[str, Any]:
    """Return the state behind bytes; anything else becomes a state that is refused when it is restored."""
    try:
        return dict(json.loads(data.decode()))
    except (ValueError, TypeError) as error:
        return {"problem": f" ({error})"}
