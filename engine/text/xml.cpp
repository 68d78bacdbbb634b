#include "engine/text/xml.h"

#include <algorithm>
#include <cstddef>
#include <pugixml.hpp>

#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

constexpr int kDeepest = 200;

// Finds lines by the offset of a character.
class Lines {
  public:
    explicit Lines(std::string_view text) {
        for (std::size_t i = 0; i < text.size(); ++i) {
            if (text[i] == '\n') starts_.push_back(i + 1);
        }
    }
    Location at(const std::string& file, std::ptrdiff_t offset) const {
        const auto place = static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0));
        const auto next = std::upper_bound(starts_.begin(), starts_.end(), place);
        return {file, static_cast<int>(next - starts_.begin()), static_cast<int>(place - *(next - 1)) + 1};
    }

  private:
    std::vector<std::size_t> starts_{0};
};

std::string without_prefix(std::string_view name) {
    return std::string(name.substr(name.find(':') + 1));  // npos + 1 is 0
}

XmlElement element_of(const pugi::xml_node& node, const Lines& lines, const std::string& file, int depth) {
    XmlElement element;
    const Location place = lines.at(file, node.offset_debug());
    if (depth > kDeepest) input_error(place, "elements are nested deeper than {}", kDeepest);
    element.name = without_prefix(node.name());
    element.line = place.line;
    for (const pugi::xml_attribute& given : node.attributes())
        element.attributes.emplace_back(without_prefix(given.name()), given.value());
    std::string text;
    for (const pugi::xml_node& inner : node.children()) {
        if (inner.type() == pugi::node_element)
            element.children.push_back(element_of(inner, lines, file, depth + 1));
        else
            text += inner.value();  // text and CDATA; the parser leaves comments out
    }
    element.text = trimmed(text);
    return element;
}

}  // namespace

const XmlElement* XmlElement::child(std::string_view child_name) const {
    const auto found =
        std::ranges::find_if(children, [&](const XmlElement& inner) { return inner.name == child_name; });
    return found == children.end() ? nullptr : &*found;
}

std::string_view XmlElement::text_of(std::string_view child_name) const {
    const XmlElement* found = child(child_name);
    return found ? std::string_view(found->text) : std::string_view();
}

std::vector<const XmlElement*> XmlElement::all(std::string_view child_name) const {
    std::vector<const XmlElement*> found;
    for (const XmlElement& inner : children) {
        if (inner.name == child_name) found.push_back(&inner);
    }
    return found;
}

const XmlElement* XmlElement::find(std::string_view element_name) const {
    for (const XmlElement& inner : children) {
        if (inner.name == element_name) return &inner;
        if (const XmlElement* found = inner.find(element_name)) return found;
    }
    return nullptr;
}

const std::string* XmlElement::attribute(std::string_view attribute_name) const {
    const auto found =
        std::ranges::find_if(attributes, [&](const auto& pair) { return pair.first == attribute_name; });
    return found == attributes.end() ? nullptr : &found->second;
}

XmlElement parse_xml(std::string_view text, const std::string& file) {
    pugi::xml_document document;
    const pugi::xml_parse_result result = document.load_buffer(text.data(), text.size());
    const Lines lines(text);
    if (!result) {
        input_error(lines.at(file, result.offset), "the XML is not well-formed: {}",
                    one_line(result.description()));
    }
    return element_of(document.document_element(), lines, file, 0);
}

}  // namespace lucerna
