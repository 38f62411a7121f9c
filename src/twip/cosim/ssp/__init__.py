"""System structures: SSP files read, checked and flattened to components, connections and parameters."""
