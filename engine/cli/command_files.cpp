#include "engine/cli/command_files.h"

#include <fmt/format.h>

#include <span>

#include "engine/base/error.h"
#include "engine/system/files.h"

namespace lucerna {

void require_writable(const std::filesystem::path& file, std::string_view suffix) {
    const Location at{file.string()};
    if (file.empty()) throw InputError("the output needs a file name");
    if (!suffix.empty() && suffix_of(file) != suffix) {
        input_error(at, "the output's name must end in {}", suffix);
    }
    std::error_code status;
    if (std::filesystem::is_directory(file, status))
        throw InputError(at, "is a folder; a file name is needed");
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    if (!std::filesystem::exists(folder, status)) {
        input_error(at, "cannot be written: the folder {} does not exist", folder.string());
    }
    if (!std::filesystem::is_directory(folder, status)) {
        input_error(at, "cannot be written: {} is not a folder", folder.string());
    }
    require_replaceable(file);
}

void CommandFiles::reads(const std::filesystem::path& file) {
    add({file, FileIdentity(file), {}});
}

void CommandFiles::reads(std::span<const std::filesystem::path> files) {
    for (const std::filesystem::path& file : files) reads(file);
}

void CommandFiles::writes(const std::filesystem::path& file, std::string_view suffix, std::string_view by) {
    require_writable(file, suffix);
    add({file, FileIdentity(file), std::string(by)});
}

void CommandFiles::writes_beside(const std::filesystem::path& file, std::string_view by) {
    add({file, FileIdentity(file), std::string(by)});
}

void CommandFiles::writes_into(const std::filesystem::path& folder, std::string_view by,
                               std::function<bool(const std::string& name)> owns) {
    const Folder made{folder, FileIdentity(folder / "x").folder(), std::string(by), std::move(owns)};
    for (const auto* files : {&inputs_, &outputs_}) {
        for (const File& file : *files) require_outside(made, file);
    }
    folders_.push_back(made);
}

void CommandFiles::add(const File& file) {
    if (file.by.empty()) {
        for (const File& output : outputs_) require_apart(output, file);
    } else {
        for (const auto* files : {&inputs_, &outputs_}) {
            for (const File& other : *files) require_apart(file, other);
        }
    }
    for (const Folder& folder : folders_) require_outside(folder, file);
    (file.by.empty() ? inputs_ : outputs_).push_back(file);
}

void CommandFiles::require_apart(const File& output, const File& other) {
    if (output.identity.is_stream() || !(output.identity == other.identity)) return;
    const std::string as = output.name.lexically_normal() == other.name.lexically_normal()
                               ? std::string()
                               : fmt::format("is the same file as {}, which ", other.name.string());
    if (other.by.empty())
        input_error({output.name.string()},
                    "{}is read by this command and would be overwritten; choose another file for {}", as,
                    output.by);
    input_error({output.name.string()}, "{}is already the output of {}; choose another file for {}", as,
                other.by, output.by);
}

void CommandFiles::require_outside(const Folder& folder, const File& file) {
    if (file.identity.folder() != folder.place || !folder.owns(file.identity.name().string())) return;
    input_error(
        {file.name.string()}, "{}; {} writes files of such names into {}",
        file.by.empty() ? "is read by this command and might be overwritten" : "is the output of " + file.by,
        folder.by, folder.name.string());
}

void declare(const ImageOutput& output, CommandFiles& files) {
    files.writes(output.file, ".exr", "-o");
    if (output.png) files.writes(png_beside(output.file), ".png", "--png");
}

void write_text(const std::filesystem::path& file, std::string_view text) {
    const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
    replace_file(file, std::span(&bytes, 1));
}

}  // namespace lucerna
