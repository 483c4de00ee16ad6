//! The gRPC service and its blocking client.
