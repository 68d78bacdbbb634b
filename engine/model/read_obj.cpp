// Reads OBJ and MTL by tinyobjloader. It reads a wrong number as 0 and, through the interface used here, does
// not resolve indices; so every line is checked before it gets it, and every index afterwards. Its other
// interface cuts concave faces wrongly, ends names at a space and states no lines.
#define TINYOBJLOADER_USE_DOUBLE
#include <tiny_obj_loader.h>

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <istream>
#include <map>
#include <streambuf>
#include <tuple>
#include <unordered_map>

#include "engine/base/error.h"
#include "engine/base/float_traps.h"
#include "engine/model/model.h"
#include "engine/system/files.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

namespace fs = std::filesystem;

constexpr double kMost = 1e12;              // of any number in a file
constexpr std::size_t kMostCorners = 4000;  // of a face: the time to cut it into triangles has a bound
constexpr float kUnknown = 0.5F;            // reflectance where none is stated
// Memory while a model is read, at most.
constexpr std::uint64_t kBytesOfLetter = 10, kBytesOfCorner = 200, kBytesOfMesh = 2048;

std::vector<std::string_view> obj_words(std::string_view line) {
    std::vector<std::string_view> words;
    for (std::size_t end = 0; (end = line.find_first_not_of(" \t", end)) != line.npos;) {
        const std::size_t begin = end;
        end = std::min(line.find_first_of(" \t", begin), line.size());
        words.push_back(line.substr(begin, end - begin));
    }
    if (!words.empty() && words[0].starts_with('#')) words.clear();
    return words;
}

bool is_number(std::string_view word) {
    double ignored = 0;
    const auto end = word.data() + word.size();
    return std::from_chars(word.data(), end, ignored).ptr == end;
}

// Returns what follows a line's first word, without white space around it: a name, which may contain spaces.
std::string rest_of(const std::vector<std::string_view>& words) {
    if (words.size() < 2) return {};
    return {words[1].data(), words.back().data() + words.back().size()};
}

// Returns the path of a file that another file names.
fs::path path_beside(const fs::path& file, std::string name) {
    std::ranges::replace(name, '\\', '/');
    return file.parent_path() / name;
}

// A text as a stream that ends after each line, so that `see` is called with a line, which it may change, and
// its number just before the stream's reader gets it. Joins lines that end in a backslash.
class ObjLines : public std::streambuf {
  public:
    using See = std::function<void(std::string& line, int number)>;
    ObjLines(std::string text, See see) : text_(std::move(text)), see_(std::move(see)) {
        if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;  // the mark of UTF-8
    }

  protected:
    int_type underflow() override {
        if (at_ >= text_.size()) return traits_type::eof();
        line_.clear();
        const int number = next_;
        bool more = true;
        while (more && at_ < text_.size()) {
            const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
            line_.append(text_, at_, end - at_);
            at_ = end + (text_.compare(end, 2, "\r\n") == 0 ? 2 : 1);
            ++next_;
            more = line_.ends_with('\\');
            if (more) line_.back() = ' ';
        }
        see_(line_, number);
        line_ += '\n';
        setg(line_.data(), line_.data(), line_.data() + line_.size());
        return traits_type::to_int_type(line_.front());
    }

  private:
    std::string text_, line_;
    See see_;
    std::size_t at_ = 0;
    int next_ = 1;
};

struct ObjCorner {
    int p, n, uv;  // n and uv: -1 for none
    bool operator==(const ObjCorner&) const = default;
};
struct ObjCornerHash {
    std::size_t operator()(const ObjCorner& corner) const {
        std::size_t hash = 0;
        for (const int i : {corner.p, corner.n, corner.uv})
            hash = (hash ^ static_cast<std::size_t>(i)) * 0x9E3779B97F4A7C15U;
        return hash ^ hash >> 32;
    }
};

// One "newmtl" of a file.
struct ObjMaterial {
    Location at;
    std::vector<std::pair<std::string, int>> unread;  // words and their lines
    std::optional<tinyobj::material_t> read = {};
    bool has_kd = false;
    int index = -1;  // in Model::materials, once it is used
};

class ObjReader {
  public:
    ObjReader(const fs::path& file, const ObjFrame& frame, Monitor& monitor)
        : file_(file), frame_(frame), monitor_(monitor), at_{file.string()} {}

    Model read();

  private:
    template <typename... Args>
    [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
        throw InputError(at_, one_line(fmt::format(format, std::forward<Args>(args)...)));
    }
    void warn(const std::string& text) const {
        monitor_.warn(fmt::format("{}: {}", file_.string(), one_line(text)));
    }
    void leave_out(const std::string& what, const Location& at) {
        ++unread_.try_emplace(what, std::pair(at, 0)).first->second.second;
    }

    void see(std::string& line, int number);
    void add_vertex(const V3d& p);
    void add_face(std::span<const tinyobj::index_t> corners);
    int resolved(int index, std::size_t count, const char* what) const;
    std::size_t mesh_of(bool normals, bool uvs);

    void read_libraries(const std::vector<std::string_view>& words);
    void read_library(const fs::path& file);
    int material(const std::string& name);
    int default_material();
    ModelMaterial converted(const std::string& name, const ObjMaterial& from);
    ModelTexture texture(const ObjMaterial& from, const std::string& name,
                         const tinyobj::texture_option_t& options, bool needed = false);
    void read_cutout(ModelMaterial& made, const ObjMaterial& from);

    fs::path file_;
    ObjFrame frame_;
    Monitor& monitor_;
    Location at_;  // the line that is read
    Model out_;
    std::vector<V3d> p_, n_;
    std::vector<V2d> uv_;
    std::string name_;   // of the present object or group
    int material_ = -1;  // the present one's index
    int default_ = -1;
    M44d world_from_mesh_;
    std::map<std::tuple<std::string, int, bool, bool>, std::size_t> meshes_;
    std::vector<std::unordered_map<ObjCorner, int, ObjCornerHash>> vertices_;  // of each mesh
    std::map<std::string, ObjMaterial> materials_;
    std::map<fs::path, int> images_;
    std::map<std::string, std::pair<Location, int>> unread_;  // the first place, and how many there are
    MemoryWatch memory_{file_.string(), "use a model with fewer parts"};
};

// Returns the words of a line as numbers.
std::vector<double> numbers_of(const Location& at, const std::string& line,
                               std::span<const std::string_view> words, double least) {
    std::vector<double> numbers;
    for (const std::string_view word : words) {
        const Location there{at.file, at.line, static_cast<int>(word.data() - line.data()) + 1};
        numbers.push_back(parse_number(there, word, least, kMost));
    }
    return numbers;
}

// Returns a line that tinyobjloader reads right: it takes "0e999" for NaN.
std::string plain_numbers(std::string_view word, const std::vector<double>& numbers) {
    return fmt::format("{} {}", word, fmt::join(numbers, " "));
}

// --- geometry ---

void ObjReader::see(std::string& line, int number) {
    at_.line = number, at_.column = 1;
    memory_.add(line.size() * kBytesOfLetter);
    const std::vector<std::string_view> words = obj_words(line);
    if (words.empty()) return;
    const std::string_view word = words[0];
    const std::span<const std::string_view> all(words);
    if (word == "v" || word == "vn" || word == "vt") {
        const std::size_t least = word == "vt" ? 1 : 3, count = words.size() - 1;
        if (count < least) fail("\"{}\" with {} numbers; expected {}", word, count, least);
        if (word == "v" && count > 4) leave_out("the colour of vertices", at_);
        line = plain_numbers(word,
                             numbers_of(at_, line, all.subspan(1, std::min<std::size_t>(count, 3)), -kMost));
    } else if (word == "g" || word == "o") {
        name_ = rest_of(words);
    } else if (word == "usemtl") {
        material_ = material(rest_of(words));
    } else if (word == "mtllib") {
        read_libraries(words);
    } else if (word == "f") {
        // tinyobjloader would read the next corner's number after a slash that nothing follows.
        for (std::size_t i = line.size(); i-- > 0;) {
            if (line[i] == '/' && (i + 1 == line.size() || line[i + 1] == ' ' || line[i + 1] == '\t'))
                line[i] = ' ';
        }
    } else if (word != "s") {
        leave_out(fmt::format("\"{}\"", word), at_);
    }
}

void ObjReader::add_vertex(const V3d& p) {
    memory_.add(sizeof(V3d));
    if (p_.empty()) {
        // Meshes are stored in float32 around the first vertex, which may be far from the origin.
        const double u = frame_.unit;
        if (frame_.z_up) world_from_mesh_ = M44d(u, 0, 0, 0, 0, 0, -u, 0, 0, u, 0, 0, 0, 0, 0, 1);
        if (!frame_.z_up) world_from_mesh_.setScale(u);
        V3d at;
        world_from_mesh_.multDirMatrix(p, at);
        for (int i = 0; i < 3; ++i) world_from_mesh_[3][i] = at[i];
    }
    p_.push_back(p);
}

int ObjReader::resolved(int index, std::size_t count, const char* what) const {
    const std::int64_t all = static_cast<std::int64_t>(count);
    const std::int64_t at = index > 0 ? index - 1 : all + index;
    if (index == 0 || at < 0 || at >= all)
        fail("{} {} does not exist; there are {} so far", what, index, all);
    return static_cast<int>(at);
}

std::size_t ObjReader::mesh_of(bool normals, bool uvs) {
    const int material = material_ >= 0 ? material_ : default_material();
    const auto [found, made] = meshes_.try_emplace({name_, material, normals, uvs}, out_.meshes.size());
    if (made) {
        memory_.add(kBytesOfMesh + name_.size());
        out_.placements.push_back({out_.meshes.size(), world_from_mesh_});
        ModelMesh& mesh = out_.meshes.emplace_back();
        mesh.name = name_, mesh.material = material;
        vertices_.emplace_back();
    }
    return found->second;
}

void ObjReader::add_face(std::span<const tinyobj::index_t> corners) {
    if (corners.size() > kMostCorners)
        fail("a face of {} corners; at most {} are accepted", corners.size(), kMostCorners);
    memory_.add(corners.size() * kBytesOfCorner);
    std::vector<ObjCorner> used;
    std::vector<V3d> outline;
    bool normals = true, uvs = true;
    for (const tinyobj::index_t& corner : corners) {
        const int p = resolved(corner.vertex_index, p_.size(), "vertex");
        const int n = corner.normal_index == 0 ? -1 : resolved(corner.normal_index, n_.size(), "normal");
        const int uv = corner.texcoord_index == 0
                           ? -1
                           : resolved(corner.texcoord_index, uv_.size(), "texture coordinate");
        normals = normals && n >= 0 && n_[static_cast<std::size_t>(n)] != V3d(0);
        uvs = uvs && uv >= 0;
        used.push_back({p, n, uv});
        outline.push_back(p_[static_cast<std::size_t>(p)]);
    }
    const std::vector<V3i> triangles = triangles_of_polygon(outline);
    if (triangles.empty()) return leave_out("a face without area", at_);
    const std::size_t index = mesh_of(normals, uvs);
    ModelMesh& mesh = out_.meshes[index];
    std::vector<int> local;
    for (ObjCorner corner : used) {
        if (!normals) corner.n = -1;
        if (!uvs) corner.uv = -1;
        const auto [found, made] = vertices_[index].try_emplace(corner, static_cast<int>(mesh.p.size()));
        local.push_back(found->second);
        if (!made) continue;
        mesh.p.emplace_back(p_[static_cast<std::size_t>(corner.p)] - p_[0]);
        if (normals) mesh.n.emplace_back(n_[static_cast<std::size_t>(corner.n)].normalized());
        if (uvs) mesh.uv.emplace_back(uv_[static_cast<std::size_t>(corner.uv)]);
    }
    for (const V3i& t : triangles) {
        mesh.triangles.emplace_back(local[static_cast<std::size_t>(t.x)],
                                    local[static_cast<std::size_t>(t.y)],
                                    local[static_cast<std::size_t>(t.z)]);
    }
}

// --- materials ---

// Reads the files of an "mtllib" line: one whose name may contain spaces, or several.
void ObjReader::read_libraries(const std::vector<std::string_view>& words) {
    std::vector<fs::path> files{path_beside(file_, rest_of(words))};
    std::error_code status;
    if (!fs::exists(files[0], status) && words.size() > 2) {
        files.clear();
        for (const std::string_view word : std::span(words).subspan(1))
            files.push_back(path_beside(file_, std::string(word)));
    }
    for (const fs::path& file : files) {
        try {
            require_readable(file);
        } catch (const InputError& cause) {
            fail("{}", cause.what());
        }
        read_library(file);
    }
}

void ObjReader::read_library(const fs::path& file) {
    out_.files.push_back(file);
    ObjMaterial* present = nullptr;
    const auto see_line = [&](std::string& line, int number) {
        const Location at{file.string(), number, 1};
        memory_.add(line.size() * kBytesOfLetter);
        const std::vector<std::string_view> words = obj_words(line);
        if (words.empty()) return;
        const std::string word(words[0]);
        const std::span<const std::string_view> all(words);
        const auto is_one_of = [&word](std::initializer_list<const char*> known) {
            return std::ranges::find(known, word) != known.end();
        };
        const auto leave = [&](const std::string& what) {
            if (present) present->unread.emplace_back(what, number);
        };
        if (word == "newmtl") {
            present = &materials_.try_emplace(rest_of(words), ObjMaterial{at, {}}).first->second;
        } else if (is_one_of({"Kd", "Ks", "Ke"})) {
            if (words.size() != 2 && words.size() < 4)
                input_error(at, "\"{}\" with {} numbers; expected 3, or 1 for grey", word, words.size() - 1);
            if (present && word == "Kd") present->has_kd = true;
            std::vector<double> color = numbers_of(at, line, all.subspan(1, words.size() == 2 ? 1 : 3), 0);
            color.resize(3, color[0]);
            line = plain_numbers(word, color);
        } else if (is_one_of({"Ns", "Ni", "d", "Tr", "illum", "Pr", "Pm"})) {
            if (words.size() < 2) input_error(at, "\"{}\" without a number", word);
            line = plain_numbers(word, numbers_of(at, line, all.subspan(1, 1), 0));
        } else if (is_one_of({"map_Kd", "map_d", "norm"})) {
            // tinyobjloader would take the file's name for the third number of a mapping that has two.
            std::string made = word;
            std::size_t i = 1;
            while (i + 1 < words.size() && words[i].starts_with('-')) {
                const std::string_view option = words[i++];
                if (option != "-s" && option != "-o") {
                    leave(fmt::format("{} {}", word, option));
                    i += option == "-mm" ? 2 : 1;
                    continue;
                }
                std::vector<double> mapping;
                while (i + 1 < words.size() && mapping.size() < 3 && is_number(words[i]))
                    mapping.push_back(numbers_of(at, line, all.subspan(i++, 1), -kMost)[0]);
                mapping.resize(3, option == "-s" ? 1 : 0);
                made += " " + plain_numbers(option, mapping);
            }
            if (i >= words.size()) input_error(at, "\"{}\" without a file's name", word);
            line = made + line.substr(static_cast<std::size_t>(words[i].data() - line.data()) - 1);
        } else if (!is_one_of({"Ka", "map_Ka", "Tf"}) &&
                   !std::ranges::all_of(all.subspan(1), [](std::string_view value) {
                       return value.find_first_not_of("+-0.") == value.npos;
                   })) {
            leave(word);
        }
    };
    std::string text = read_text(file);
    std::uint64_t count = 1;
    for (std::size_t at = 0; (at = text.find("newmtl", at)) != text.npos; ++at) ++count;
    require_memory(bytes_of(count, 4 * sizeof(tinyobj::material_t)), file.string(), "use fewer materials");
    ObjLines lines(std::move(text), see_line);
    std::istream in(&lines);
    in.exceptions(std::ios::badbit);  // which passes on what see_line throws
    std::map<std::string, int> numbers;
    std::vector<tinyobj::material_t> read;
    std::string ignored;
    tinyobj::LoadMtl(&numbers, &read, &in, &ignored, &ignored);
    for (tinyobj::material_t& each : read) {
        const std::string line = "newmtl " + each.name;
        const auto found = materials_.find(rest_of(obj_words(line)));
        if (found != materials_.end() && !found->second.read) found->second.read = std::move(each);
    }
}

Rgb color_of(const tinyobj::real_t (&numbers)[3]) {
    return Rgb(static_cast<float>(numbers[0]), static_cast<float>(numbers[1]),
               static_cast<float>(numbers[2]));
}

// Returns the index of a material, which is converted when it is first used.
int ObjReader::material(const std::string& name) {
    const auto found = materials_.find(name);
    if (found == materials_.end() || !found->second.read)
        fail("material \"{}\" is not defined; expected \"newmtl {}\" in a file that \"mtllib\" names before",
             name, name);
    ObjMaterial& from = found->second;
    if (from.index < 0) {
        for (const auto& [word, line] : from.unread)
            leave_out(fmt::format("\"{}\"", word), {from.at.file, line, 1});
        from.index = static_cast<int>(out_.materials.size());
        out_.materials.push_back(converted(name, from));
    }
    return from.index;
}

int ObjReader::default_material() {
    if (default_ < 0) {
        default_ = static_cast<int>(out_.materials.size());
        ModelMaterial& made = out_.materials.emplace_back();
        made.name = "without material", made.base = Rgb(kUnknown), made.metallic = 0;
        warn("faces without a material are diffuse, of reflectance 0.5");
    }
    return default_;
}

// A render refuses a picture that does not exist, unless it is told to leave it out; here it gets a warning.
ModelTexture ObjReader::texture(const ObjMaterial& from, const std::string& name,
                                const tinyobj::texture_option_t& options, bool needed) {
    ModelTexture made;
    if (name.empty()) return made;
    const fs::path file = path_beside(from.at.file, name);
    const auto [found, is_new] = images_.try_emplace(file, static_cast<int>(out_.images.size()));
    if (is_new) {
        try {
            require_readable(file);
        } catch (const InputError& cause) {
            const std::string text = fmt::format("{}: material \"{}\": {}", to_string(from.at),
                                                 one_line(from.read->name), one_line(cause.what()));
            if (needed) throw InputError(text);
            monitor_.warn(text);
        }
        out_.images.push_back({file, {}, {}});
        out_.files.push_back(file);
    }
    made.image = found->second;
    made.scale = V2d(options.scale[0], options.scale[1]);
    made.offset = V2d(options.origin_offset[0], options.origin_offset[1]);
    return made;
}

// Reads the opacity from a picture's alpha, or if it has none from its red, as a grey picture has it.
void ObjReader::read_cutout(ModelMaterial& made, const ObjMaterial& from) {
    made.cutout_texture = texture(from, from.read->alpha_texname, from.read->alpha_texopt, true);
    if (made.cutout_texture.image < 0) return;
    const fs::path& file = out_.images[static_cast<std::size_t>(made.cutout_texture.image)].file;
    std::optional<Pixels> pixels = decoded_picture(read_bytes(file), file.string());
    if (!pixels) return leave_out("\"map_d\" of 16 bits", from.at);
    const auto alpha_of = [&](std::size_t i) -> unsigned char& { return pixels->rgba[4 * i + 3]; };
    const std::size_t count = pixels->rgba.size() / 4;
    bool opaque = true;
    for (std::size_t i = 0; i < count; ++i) opaque = opaque && alpha_of(i) == 255;
    for (std::size_t i = 0; opaque && i < count; ++i) alpha_of(i) = pixels->rgba[4 * i];
    require_memory(count * sizeof(float), file.string() + ": its opacity", "use fewer pixels");
    made.cutout = cutout_of(*pixels, made.alpha, std::nullopt);
    made.alpha = 1;
}

ModelMaterial ObjReader::converted(const std::string& name, const ObjMaterial& from) {
    const tinyobj::material_t& read = *from.read;
    const auto is_model = [&read](std::initializer_list<int> models) {
        return std::ranges::find(models, read.illum) != models.end();
    };
    ModelMaterial made;
    made.name = name;
    made.base_texture = texture(from, read.diffuse_texname, read.diffuse_texopt);
    made.base = from.has_kd ? color_of(read.diffuse) : Rgb(made.base_texture.image < 0 ? kUnknown : 1.0F);
    made.normal = texture(from, read.normal_texname, read.normal_texopt);
    made.emission = color_of(read.emission);
    made.ior = read.ior > 1 ? std::min(read.ior, 100.0) : 1.5;  // 1 stands for none
    made.metallic = std::min(read.metallic, 1.0);
    const Rgb gloss = color_of(read.specular);
    if (read.roughness > 0 || read.metallic > 0) {
        made.roughness = std::min(read.roughness, 1.0);
    } else if (luminance(gloss) > 0 && !is_model({1})) {
        // [Walter 2007]: the alpha that goes with Blinn's exponent. It is the roughness squared.
        made.roughness = std::sqrt(std::sqrt(2 / (read.shininess + 2)));
        if (made.base == Rgb(0.0F) && made.base_texture.image < 0 && is_model({3, 5, 8})) {
            made.base = gloss;
            made.metallic = 1;
        }
    }
    made.alpha = std::clamp(read.dissolve, 0.0, 1.0);
    if (!read.alpha_texname.empty()) {
        read_cutout(made, from);
    } else if (made.alpha <= 0.5 || (is_model({4, 6, 7, 9}) && read.ior > 1)) {
        warn(fmt::format(
            "material \"{}\" is a clear pane of glass; its colour and its d of {:.3g} are ignored", name,
            made.alpha));
        made.transmission = made.alpha = 1;
    }
    return made;
}

Model ObjReader::read() {
    Phase phase(monitor_, "OBJ", 1);
    ObjLines lines(read_text(file_), [this](std::string& line, int number) { see(line, number); });
    std::istream in(&lines);
    in.exceptions(std::ios::badbit);  // which passes on what see() throws
    tinyobj::callback_t calls;
    calls.vertex_cb = [](void* self, double x, double y, double z, double) {
        static_cast<ObjReader*>(self)->add_vertex({x, y, z});
    };
    calls.normal_cb = [](void* self, double x, double y, double z) {
        static_cast<ObjReader*>(self)->n_.emplace_back(x, y, z);
    };
    calls.texcoord_cb = [](void* self, double u, double v, double) {
        static_cast<ObjReader*>(self)->uv_.emplace_back(u, v);
    };
    calls.index_cb = [](void* self, tinyobj::index_t* corners, int count) {
        static_cast<ObjReader*>(self)->add_face({corners, static_cast<std::size_t>(count)});
    };
    const FloatTraps none(kNoFaults);
    std::string ignored;
    if (!tinyobj::LoadObjWithCallback(in, calls, this, nullptr, &ignored, &ignored)) fail("{}", ignored);
    phase.advance(1);
    at_.line = 0;
    if (out_.meshes.empty()) fail("has no faces; expected \"f\" with three or more corners");
    for (const auto& [what, where] : unread_) {
        const auto& [first, count] = where;
        monitor_.warn(fmt::format("{}: {} is not read{}", to_string(first), one_line(what),
                                  count == 1 ? "" : fmt::format(", nor {} more", count - 1)));
    }
    return std::move(out_);
}

}  // namespace

Model read_obj(const fs::path& file, const ObjFrame& frame, Monitor& monitor) {
    return ObjReader(file, frame, monitor).read();
}

}  // namespace lucerna
