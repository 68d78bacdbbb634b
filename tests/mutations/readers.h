// Declares every file reader by its fuzzer's entry (tests/fuzz/NAME_fuzz.cpp). A program can have only one
// LLVMFuzzerTestOneInput, so the build renames each to fuzz_NAME.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#define LUCERNA_EVERY_READER(X) \
    X(celltable)                \
    X(checkpoint)               \
    X(exr)                      \
    X(gltf)                     \
    X(ies)                      \
    X(ldt)                      \
    X(lightfield)               \
    X(manifest)                 \
    X(obj)                      \
    X(pbrt)                     \
    X(photons)                  \
    X(picture)                  \
    X(ply)                      \
    X(rays)                     \
    X(rig)                      \
    X(spectrum)                 \
    X(study)                    \
    X(sums)                     \
    X(tm33)                     \
    X(words)

#define LUCERNA_DECLARE_READER(name) extern "C" int fuzz_##name(const std::uint8_t* data, std::size_t size);
LUCERNA_EVERY_READER(LUCERNA_DECLARE_READER)
#undef LUCERNA_DECLARE_READER

namespace lucerna::testing {

struct Reader {
    const char* name;
    int (*read)(const std::uint8_t* data, std::size_t size);
};

inline std::vector<Reader> every_reader() {
#define LUCERNA_LIST_READER(name) {#name, fuzz_##name},
    return {LUCERNA_EVERY_READER(LUCERNA_LIST_READER)};
#undef LUCERNA_LIST_READER
}

}  // namespace lucerna::testing
