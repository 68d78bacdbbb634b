// All files of one command. Inputs and outputs are declared as soon as they are known and before any work,
// and no output may be an input or another output, under any name or link.
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
// its folder exists and accepts new files, `file` can be replaced and, for a picture, the picture library can
// be loaded. Leaves nothing behind.
void require_writable(const std::filesystem::path& file, std::string_view suffix);

// Each function throws InputError that names the output, the option that asks for it and the file that it
// would destroy.
class CommandFiles {
  public:
    void reads(const std::filesystem::path& file);
    void reads(std::span<const std::filesystem::path> files);
    // `by` is the option that asks for the file. Throws like require_writable(), too.
    void writes(const std::filesystem::path& file, std::string_view suffix, std::string_view by);
    // Declares an optional file that follows from another output.
    void writes_beside(const std::filesystem::path& file, std::string_view by);
    // Declares all files whose name `owns` accepts, in a folder that need not exist yet.
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

// Declares the image and its picture, if requested, as outputs.
void declare(const ImageOutput& output, CommandFiles& files);

// Functions that write text files.

// Writes text by replace_file, which leaves either the old file or the complete new one.
void write_text(const std::filesystem::path& file, std::string_view text);

}  // namespace lucerna
