"""All that knows Numba and LLVM: options and kernels, their cache, the lanes type, its operations, loads and stores."""
