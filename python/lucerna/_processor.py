"""Whether the processor has the instructions that the extension is compiled to use: without them Python
would end at the first of them, and without a word."""

# These features of x86-64-v3 tell processors apart. No processor has them without the others, whose names
# differ between systems.
_NEEDED = ("avx2", "bmi2", "fma")


def require() -> None:
    """ImportError with what is missing."""
    try:
        with open("/proc/cpuinfo") as file:
            flags = next(line for line in file if line.startswith("flags")).split()
    except (OSError, StopIteration):
        return
    missing = [name for name in _NEEDED if name not in flags]
    if missing:
        raise ImportError(f"lucerna: this processor lacks {', '.join(missing)}; x86-64-v3 is needed")
