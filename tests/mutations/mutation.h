// Files gone wrong on purpose: from whole ones, by a number that names what happened to them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace lucerna::testing {

// Makes of whole files as many bad ones as one likes. Input number i is the same on every machine and in
// every run.
class Mutation {
  public:
    // At least one file; `seed` for another set of bad ones.
    explicit Mutation(std::vector<std::string> whole, std::uint64_t seed = 1);

    std::string input(std::uint64_t number) const;
    // What was done to make it, for people.
    static std::string name(std::uint64_t number);

  private:
    std::vector<std::string> whole_;
    std::uint64_t seed_;
};

}  // namespace lucerna::testing
