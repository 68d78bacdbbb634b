// How strictly scene text is taken.
//
// What pbrt renders is rendered. Where this reader is stricter than pbrt, or lacks something, the scene is
// rendered all the same, and one warning says where, what is taken instead and what is lost; a strict reader
// refuses instead. Warnings that differ in nothing but their place are said once and counted.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/pbrt/tokens.h"

namespace lucerna {

class Leniency {
  public:
    Leniency(Monitor& monitor, bool strict) : monitor_(monitor), strict_(strict) {}

    // The text says `what`, which is not to be had here; `instead` is done, and `lost` by that (empty:
    // nothing that shows). Throws TextError if strict.
    void depart(const Place& at, std::string_view what, std::string_view instead, std::string_view lost = {});
    // What is no departure from the text: pbrt does the same.
    void warn(const Place& at, std::string_view message);
    // How often each warning came again; forgets them.
    void sum_up();

    bool strict() const { return strict_; }

  private:
    struct Said {
        std::string text;  // without its place
        Place first;
        std::uint64_t times = 1;
    };
    static constexpr std::size_t kDistinct = 1000;  // said; a flood of others is only counted

    Monitor& monitor_;
    bool strict_;
    std::vector<Said> said_;
    std::uint64_t unsaid_ = 0;
    std::map<std::string, std::size_t, std::less<>> index_;  // in said_, by text
};

}  // namespace lucerna
