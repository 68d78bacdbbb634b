#include "engine/cli/page_parts.h"

#include <fmt/format.h>

#include <stdexcept>
#include <vector>

namespace lucerna {
namespace {

std::string base64(const std::vector<unsigned char>& bytes) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t there = std::min<std::size_t>(3, bytes.size() - i);
        unsigned triple = 0;
        for (std::size_t k = 0; k < 3; ++k) triple = triple << 8U | (k < there ? bytes[i + k] : 0U);
        for (std::size_t k = 0; k < 4; ++k) text += k <= there ? kDigits[triple >> (18 - 6 * k) & 63U] : '=';
    }
    return text;
}

}  // namespace

std::string filled(std::string_view page, const std::map<std::string, std::string, std::less<>>& blanks) {
    std::string result;
    for (std::size_t at = 0;;) {
        const std::size_t open = page.find("{{", at);
        const std::size_t close = page.find("}}", open);
        result += page.substr(at, open == std::string_view::npos ? open : open - at);
        if (open == std::string_view::npos) return result;
        if (close == std::string_view::npos) throw std::logic_error("a page's blank has no end");
        result += blanks.at(std::string(page.substr(open + 2, close - open - 2)));
        at = close + 2;
    }
}

std::string html_text(std::string_view text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
            case '&':
                result += "&amp;";
                break;
            case '<':
                result += "&lt;";
                break;
            case '>':
                result += "&gt;";
                break;
            case '"':
                result += "&quot;";
                break;
            case '\'':
                result += "&#39;";
                break;
            default:
                result += c;
        }
    }
    return result;
}

std::string script_text(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        const auto code = static_cast<unsigned char>(c);
        if (code < 0x20 || c == '"' || c == '\\' || c == '<' || c == '>' || c == '&')
            fmt::format_to(std::back_inserter(result), "\\u{:04x}", code);
        else
            result += c;
    }
    return result + "\"";
}

std::string data_url(const Image& picture) {
    return "data:image/png;base64," + base64(png_bytes(picture));
}

}  // namespace lucerna
