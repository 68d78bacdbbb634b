// Derives corrupt files from valid ones; a number identifies each mutation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace lucerna::testing {

// Makes any number of corrupt files from valid ones. Input number i is the same on every machine and in every
// run.
class Mutation {
  public:
    // Requires at least one file; another `seed` gives another set of corrupt files.
    explicit Mutation(std::vector<std::string> whole, std::uint64_t seed = 1);

    std::string input(std::uint64_t number) const;
    // Describes the mutation for people.
    static std::string name(std::uint64_t number);

  private:
    std::vector<std::string> whole_;
    std::uint64_t seed_;
};

}  // namespace lucerna::testing
