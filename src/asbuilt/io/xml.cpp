// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/xml.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>

namespace asbuilt::io {
namespace {

constexpr std::size_t kDeepest = 64;
constexpr std::string_view kBlanks = " \t\r\n";

void append_utf8(std::string& text, std::uint32_t code) {
  const auto put = [&](std::uint32_t byte) { text += static_cast<char>(static_cast<unsigned char>(byte)); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xC0 | (code >> 6)), put(0x80 | (code & 0x3F));
  } else if (code < 0x10000) {
    put(0xE0 | (code >> 12)), put(0x80 | ((code >> 6) & 0x3F)), put(0x80 | (code & 0x3F));
  } else {
    put(0xF0 | (code >> 18)), put(0x80 | ((code >> 12) & 0x3F)), put(0x80 | ((code >> 6) & 0x3F)),
        put(0x80 | (code & 0x3F));
  }
}

class Parser {
 public:
  explicit Parser(const Input& input) : input_(input), text_(input.content) {}

  Result<XmlElement> parse() {
    if (text_.starts_with("\xef\xbb\xbf")) at_ = 3;
    XmlElement document;  // its only child is the root
    open_.push_back(&document);
    while (at_ < text_.size()) {
      ASBUILT_CHECK(step());
      if (open_.size() == 1 && !document.children.empty()) return std::move(document.children.front());
    }
    return error(open_.size() > 1 ? fmt::format("the text ends within element {}", in_quotes(open_.back()->name))
                                  : std::string("the text holds no element"));
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(std::string_view what) const { return input_.error_at_byte(at_, what); }
  [[nodiscard]] std::string_view rest() const { return text_.substr(at_); }

  Result<void> step() {
    if (rest().starts_with("<![CDATA[")) return cdata();
    if (rest().starts_with("<!--")) return skip_past("-->", "a comment");
    if (rest().starts_with("<?")) return skip_past("?>", "a processing instruction");
    if (rest().starts_with("<!")) return error("a document type stands here, which data files have no use for");
    if (rest().starts_with("</")) return end_tag();
    if (rest().starts_with("<")) return start_tag();
    const std::size_t end = std::min(text_.find('<', at_), text_.size());
    ASBUILT_TRY(text, unescaped(text_.substr(at_, end - at_)));
    if (open_.size() > 1) open_.back()->text += text;
    at_ = end;
    return {};
  }

  Result<void> skip_past(std::string_view mark, std::string_view what) {
    const std::size_t end = text_.find(mark, at_);
    if (end == std::string_view::npos) return error(fmt::format("{} has no end", what));
    at_ = end + mark.size();
    return {};
  }

  Result<void> cdata() {
    const std::size_t begin = at_ + 9;
    ASBUILT_CHECK(skip_past("]]>", "a CDATA section"));
    if (open_.size() > 1) open_.back()->text += text_.substr(begin, at_ - 3 - begin);
    return {};
  }

  Result<void> end_tag() {
    at_ += 2;
    const std::string_view name = take_name();
    skip_blanks();
    if (open_.size() == 1 || name != open_.back()->name) {
      return error(fmt::format("found the end of {}, expected that of {}", in_quotes(name),
                               open_.size() == 1 ? "nothing" : in_quotes(open_.back()->name)));
    }
    if (!take('>')) return error("an end tag is not closed");
    open_.pop_back();
    return {};
  }

  Result<void> start_tag() {
    ++at_;
    XmlElement element;
    element.name = take_name();
    if (element.name.empty()) return error("found '<' without a name after it");
    while (true) {
      skip_blanks();
      if (take('>')) break;
      if (rest().starts_with("/>")) {
        at_ += 2;
        open_.back()->children.push_back(std::move(element));
        return {};
      }
      ASBUILT_CHECK(attribute_of(element));
    }
    if (open_.size() > kDeepest) return error(fmt::format("elements are nested deeper than {}", kDeepest));
    // The parent's list does not grow while its last child is open, so that the address stays good.
    open_.back()->children.push_back(std::move(element));
    open_.push_back(&open_.back()->children.back());
    return {};
  }

  Result<void> attribute_of(XmlElement& element) {
    const std::string_view name = take_name();
    if (name.empty()) return error(fmt::format("the tag of {} is not closed", in_quotes(element.name)));
    skip_blanks();
    if (!take('=')) return error(fmt::format("attribute {} has no value", in_quotes(name)));
    skip_blanks();
    const char quote = at_ < text_.size() ? text_[at_] : ' ';
    if (quote != '"' && quote != '\'') return error(fmt::format("the value of {} is not in quotes", in_quotes(name)));
    const std::size_t end = text_.find(quote, at_ + 1);
    if (end == std::string_view::npos) return error(fmt::format("the value of {} has no end", in_quotes(name)));
    ASBUILT_TRY(value, unescaped(text_.substr(at_ + 1, end - at_ - 1)));
    element.attributes.emplace_back(std::string(name), std::move(value));
    at_ = end + 1;
    return {};
  }

  Result<std::string> unescaped(std::string_view raw) const {
    std::string text;
    while (!raw.empty()) {
      const std::size_t mark = std::min(raw.find('&'), raw.size());
      text += raw.substr(0, mark);
      raw.remove_prefix(mark);
      if (raw.empty()) break;
      const std::size_t end = raw.find(';');
      if (end == std::string_view::npos || !append_reference(raw.substr(1, end - 1), text)) {
        return error("found '&' that is no reference to a character");
      }
      raw.remove_prefix(end + 1);
    }
    return text;
  }

  static bool append_reference(std::string_view name, std::string& text) {
    constexpr std::pair<std::string_view, char> kNamed[] = {
        {"lt", '<'}, {"gt", '>'}, {"amp", '&'}, {"quot", '"'}, {"apos", '\''}};
    for (const auto& [known, character] : kNamed) {
      if (name != known) continue;
      text += character;
      return true;
    }
    if (!name.starts_with('#')) return false;
    name.remove_prefix(1);
    const bool is_hexadecimal = name.starts_with('x');
    if (is_hexadecimal) name.remove_prefix(1);
    std::uint32_t code = 0;
    const auto [end, failure] = std::from_chars(name.data(), name.data() + name.size(), code, is_hexadecimal ? 16 : 10);
    if (failure != std::errc() || end != name.data() + name.size() || code == 0 || code > 0x10FFFF) return false;
    append_utf8(text, code);
    return true;
  }

  std::string_view take_name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && std::string_view(" \t\r\n/>=<&\"'").find(text_[at_]) == std::string_view::npos) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  void skip_blanks() { at_ = std::min(text_.find_first_not_of(kBlanks, at_), text_.size()); }

  bool take(char wanted) {
    if (at_ >= text_.size() || text_[at_] != wanted) return false;
    ++at_;
    return true;
  }

  const Input& input_;
  std::string_view text_;
  std::size_t at_ = 0;
  std::vector<XmlElement*> open_;
};

}  // namespace

const XmlElement* XmlElement::child(std::string_view child_name) const {
  for (const XmlElement& element : children) {
    if (element.name == child_name) return &element;
  }
  return nullptr;
}

std::optional<std::string_view> XmlElement::attribute(std::string_view attribute_name) const {
  for (const auto& [key, value] : attributes) {
    if (key == attribute_name) return value;
  }
  return std::nullopt;
}

Result<XmlElement> parse_xml(const Input& input) { return Parser(input).parse(); }

}  // namespace asbuilt::io
