// All files of one command. What it reads and what it will write are told here as soon as they are known, and
// before any work: no output may be a file that is read, or another output, by whatever name or link.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/cli/commands.h"
#include "engine/system/files.h"

namespace lucerna {

// Throws InputError, naming the file and the cause, unless `file` ends in `suffix` (in any case; empty: any),
// its folder exists and takes new files, `file` can be replaced, and what writes pictures can be loaded if it
// is one. Leaves nothing behind.
void require_writable(const std::filesystem::path& file, std::string_view suffix);

// Each throws InputError: which output, asked for by what, would destroy which file.
class CommandFiles {
  public:
    void reads(const std::filesystem::path& file);
    void reads(std::span<const std::filesystem::path> files);
    // `by`: the option that asks for it. Throws as require_writable does, too.
    void writes(const std::filesystem::path& file, std::string_view suffix, std::string_view by);
    // The same of a file that follows from another output and that the command can do without.
    void writes_beside(const std::filesystem::path& file, std::string_view by);
    // Files that the command names itself, in a folder that need not be there: all whose name `owns`.
    void writes_into(const std::filesystem::path& folder, std::string_view by,
                     std::function<bool(const std::string& name)> owns);

  private:
    struct File {
        std::filesystem::path name;
        FileIdentity identity;
        std::string by;  // empty: an input
    };
    struct Folder {
        std::filesystem::path name, place;
        std::string by;
        std::function<bool(const std::string& name)> owns;
    };
    static void require_apart(const File& output, const File& other);
    static void require_outside(const Folder& folder, const File& file);
    void add(const File& file);

    std::vector<File> inputs_, outputs_;
    std::vector<Folder> folders_;
};

// The image and its picture, if one is asked for, as outputs.
void declare(const ImageOutput& output, CommandFiles& files);

// Text files that a command writes.

// Writes text by replace_file: the old file or the new one, never half of one.
void write_text(const std::filesystem::path& file, std::string_view text);

}  // namespace lucerna
