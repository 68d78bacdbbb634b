#include "engine/pbrt/leniency.h"

namespace lucerna {

void Leniency::depart(const Place& at, std::string_view what, std::string_view instead,
                      std::string_view lost) {
    if (strict_) throw TextError(at, std::string(what));
    const std::string loss = lost.empty() ? "" : fmt::format("; lost: {}", lost);
    warn(at, fmt::format("{}; {}{}", what, instead, loss));
}

void Leniency::warn(const Place& at, std::string_view message) {
    const auto known = index_.find(message);
    if (known != index_.end()) {
        ++said_[known->second].times;
        return;
    }
    if (said_.size() >= kDistinct) {
        ++unsaid_;
        return;
    }
    index_.emplace(message, said_.size());
    said_.push_back({std::string(message), at});
    monitor_.warn(fmt::format("{}: {}", to_string(at.location()), message));
}

void Leniency::sum_up() {
    for (const Said& said : said_) {
        if (said.times < 2) continue;
        monitor_.warn(fmt::format("{}: {}: and {} more like it", to_string(said.first.location()), said.text,
                                  said.times - 1));
    }
    if (unsaid_ > 0) monitor_.warn(fmt::format("{} more warnings of the scene's text are not said", unsaid_));
    unsaid_ = 0;
    said_.clear();
    index_.clear();
}

}  // namespace lucerna
