"""Many runs of one system with other values, here or on a cluster, and what they say together."""
