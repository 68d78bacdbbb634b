// What an acquisition that was stopped has done, kept in a file from which the next one goes on.
//
// The file is a list of finished columns of M, each with a checksum, added one by one: whatever ends the
// program, at most the last of them is lost. It names the work it belongs to by a key, and is of no use for
// any other. For this machine's byte order; thrown away when the work is done.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <span>
#include <vector>

namespace lucerna {

// Throws InputError if there is something that is no regular file, or a link: unfinished work is never kept
// in what somebody else put there.
void require_own_part(const std::filesystem::path& file);

class AcquirePart {
  public:
    // Takes up the file if there is one, without what is damaged at its end; begins it if not, or if it holds
    // no column. Throws InputError if it is of other work, none of ours, or cannot be written.
    AcquirePart(const std::filesystem::path& file, std::uint64_t key);

    std::size_t columns() const { return places_.size(); }  // found in the file at the start

    // May be called from any thread. take() fills `values` if the file has as many of that column, and says
    // whether it did; keep() adds a column. Both throw InputError if the file cannot be read or written.
    bool take(int column, std::span<float> values);
    void keep(int column, std::span<const float> values);

  private:
    struct Place {
        std::uint64_t offset, count;
    };
    void begin(std::uint64_t key);
    void read_list(std::uint64_t key);

    std::filesystem::path file_;
    std::fstream stream_;
    std::map<int, Place> places_;
    std::mutex mutex_;
};

}  // namespace lucerna
