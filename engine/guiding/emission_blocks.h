// From the second moments of pre-pass paths to blocks of emission numbers: how LearnedEmission is learned.
//
// A trial is one light path drawn plainly: the numbers it began with and the second moment of what it brought
// to the picture (importance_pre_pass.h says of what). Drawn from density q instead of p, paths have the
// variance ∫ m p²/q - (mean)², m the mean second moment at given numbers; over all q that is least for q ∝ p
// sqrt(m). So the importance of a block is the root of the mean of its trials' second moments, and cutting a
// block pays by as much as the mean of its parts' roots lies below the root of their mean.
//
// Blocks are cut in half, the one that pays most first, as long as its trials show beyond chance that its
// parts differ: eight slices along an axis are compared by a chi-square test, so that chance alone cuts about
// one block in a thousand. Eight and not two: what the picture needs of a lamp often lies in its middle,
// where both halves are equally important.
#pragma once

#include <span>
#include <vector>

#include "photon/learned_emission.h"

namespace lucerna {

struct EmitTrial {
    LeSampleU u;
    float score = 0;  // second moment, in any unit; finite, not negative; 0: it brought nothing
};

struct BlockSettings {
    std::size_t most_cuts = 4096;   // of all lights' blocks
    std::size_t least_trials = 32;  // in a block that is cut
};

// `trials[i]`: those of light i, in any order; they are moved about. `powers`: of the lights, by which they
// were drawn; a light without trials is as important as all are on the average. The same for the same trials.
std::vector<EmitBlocks> learn_blocks(std::span<std::vector<EmitTrial>> trials, std::span<const double> powers,
                                     const BlockSettings& settings);

}  // namespace lucerna
