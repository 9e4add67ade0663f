#include "hardware/nav_payload/bluefin_sentences.h"

#include <cstdint>
#include <cstdio>
#include <utility>

#include "hardware/nav_payload/text_numbers.h"

namespace vog {
namespace {

using Result = std::variant<Sentence, SentenceError>;

std::uint8_t XorOf(std::string_view text) {
  std::uint8_t sum = 0;
  for (const char c : text) sum ^= static_cast<std::uint8_t>(c);
  return sum;
}

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

/// Takes "*hh" away from the end of `body`. Whether it was there and right.
bool TakeChecksum(std::string_view& body) {
  const std::size_t star = body.size() - 3;
  const int high = HexDigit(body[star + 1]), low = HexDigit(body[star + 2]);
  body = body.substr(0, star);
  return high >= 0 && low >= 0 && XorOf(body) == 16 * high + low;
}

template <class Kind>
Result ParseAs(std::vector<std::string> texts) {
  SentenceFields fields(std::move(texts));
  Kind sentence;
  sentence.Visit(fields);
  if (!fields.is_count_right()) return SentenceError::kWrongFieldCount;
  if (fields.has_bad_field()) return SentenceError::kBadField;
  return Sentence(std::move(sentence));
}

template <std::size_t... I>
Result ParseById(std::string_view id, std::vector<std::string> texts, std::index_sequence<I...>) {
  Result result = SentenceError::kUnknownId;
  const auto try_kind = [&]<class Kind>(std::type_identity<Kind>) {
    if (Kind::kId == id) result = ParseAs<Kind>(std::move(texts));
    return Kind::kId == id;
  };
  static_cast<void>(
      (try_kind(std::type_identity<std::variant_alternative_t<I, Sentence>>{}) || ...));
  return result;
}

}  // namespace

Result ParseSentence(std::string_view line) {
  while (line.ends_with('\n') || line.ends_with('\r')) line.remove_suffix(1);
  const std::size_t dollar = line.rfind('$');
  if (dollar == std::string_view::npos) return SentenceError::kNoSentence;
  std::string_view body = line.substr(dollar + 1);
  const bool has_checksum = body.size() >= 3 && body[body.size() - 3] == '*';
  if (has_checksum && !TakeChecksum(body)) return SentenceError::kBadChecksum;
  const std::string_view id = body.substr(0, body.find(','));
  if (!has_checksum && id != LogSentence::kId) return SentenceError::kNoSentence;
  const bool has_fields = id.size() < body.size();
  auto texts =
      has_fields ? SplitFields(body.substr(id.size() + 1), ',') : std::vector<std::string>();
  return ParseById(id, std::move(texts), std::make_index_sequence<std::variant_size_v<Sentence>>());
}

std::string FormatSentence(const Sentence& sentence) {
  SentenceFields fields;
  std::string body;
  std::visit(
      [&](auto kind) {
        kind.Visit(fields);
        body = kind.kId;
      },
      sentence);
  for (const std::string& field : fields.fields()) body += "," + field;
  char checksum[6];
  std::snprintf(checksum, sizeof checksum, "*%02X\r\n", XorOf(body));
  return "$" + body + checksum;
}

}  // namespace vog
