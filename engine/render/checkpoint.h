// The state from which a render continues where another one stopped, and the file that stores it.
//
// The sums of every pixel, and how many samples each tile has. All else is made anew: random numbers are
// functions of the seed, and so are photon maps. The image is then, bit for bit, that of a render which never
// stopped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "engine/text/facts.h"

namespace lucerna {

struct Checkpoint {
    Facts facts;
    double seconds = 0;                     // that the image has taken so far
    int samples_done = 0;                   // of every pixel
    int passes_done = 0;                    // of an integrator that works in passes
    std::vector<std::int32_t> tiles;        // samples of each tile's pixels, >= samples_done
    std::vector<std::byte> film;            // Film::sums()
    std::vector<std::byte> allocation;      // SampleAllocation::state(), of an adaptive render
    std::uint64_t bad_samples = 0;          // left out
    std::string first_bad;                  // of them
    std::uint64_t rays = 0;                 // traced so far
    std::uint64_t invalid_rays = 0;         // of them
    std::map<std::string, double> numbers;  // RenderReport's, of the passes done
    std::map<std::string, std::string> notes;
};

// Replaces the file. Throws InputError.
void save_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint);

// Throws InputError: no such file, none of ours, cut off, damaged, of a newer version.
Checkpoint load_checkpoint(const std::filesystem::path& file);

// Throws InputError that names `file` and the first fact in which the checkpoint differs from `facts`.
void require_same(const std::filesystem::path& file, const Facts& made_with, const Facts& facts);

}  // namespace lucerna
