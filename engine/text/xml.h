// XML as a tree of elements with their lines.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/error.h"

namespace lucerna {

// Names are without the prefix of their namespace: "IntData" for <tm:IntData>.
struct XmlElement {
    std::string name;
    std::string text;  // directly inside, without white space at both ends
    std::vector<std::pair<std::string, std::string>> attributes;
    std::vector<XmlElement> children;
    int line = 0;

    // Returns the first child of the name, or null.
    const XmlElement* child(std::string_view child_name) const;
    // Returns the text of the first child of the name, or "".
    std::string_view text_of(std::string_view child_name) const;
    std::vector<const XmlElement*> all(std::string_view child_name) const;
    // Returns the first element of the name at any depth below this one, or null.
    const XmlElement* find(std::string_view element_name) const;
    // Returns the value of the attribute, or null.
    const std::string* attribute(std::string_view attribute_name) const;
};

// Returns the root element. External entities and document types are not read. `file` names the file in
// messages. Throws InputError for text that is not XML, with line and column.
XmlElement parse_xml(std::string_view text, const std::string& file);

}  // namespace lucerna
