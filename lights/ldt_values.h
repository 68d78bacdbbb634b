// The lines of an EULUMDAT file as values.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/monitor.h"
#include "lights/photometric_files.h"

namespace lucerna {

// Returns the lines, from line 1 of the format on. Lines that mangled line ends have doubled, and lines
// before the first one, are left out, and a missing first line is added, each with a warning. Throws
// InputError for UTF-16.
std::vector<TextLine> ldt_lines(std::string_view text, const std::string& file, Monitor& monitor);

// Gives the values, one per line, in order. A comma is a decimal comma, as in the countries of the format. In
// a file with decimal points, a comma before three digits may also separate thousands.
class LdtValues {
  public:
    LdtValues(std::vector<TextLine> lines, std::string file);

    std::string_view text(std::string_view what);
    // An empty line gives `empty`, if that is set.
    double number(std::string_view what, double least, double most, std::optional<double> empty = {});
    int whole(std::string_view what, int least, int most);
    // Returns the location of the last value.
    Location place() const { return {file_, next_ > 0 ? lines_[next_ - 1].number : 0, 1}; }
    bool any_left() const;
    // Returns the values that are left, each word as a line and without empty lines. Returns none if some are
    // no numbers.
    std::optional<LdtValues> words_left() const;
    std::size_t left() const { return lines_.size() - next_; }

  private:
    std::vector<TextLine> lines_;
    std::string file_;
    std::size_t next_ = 0;
    bool points_ = false;  // some numbers of the file have decimal points
};

}  // namespace lucerna
