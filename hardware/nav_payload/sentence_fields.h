#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lib/base/time.h"

namespace vog {

/// Visits each field of a sentence once, in its order on the wire; that one visit reads and writes
/// it. Reading fills the visited values, writing leaves the text of them. A sentence lists its
/// fields in `void Visit(SentenceFields& f)`.
class SentenceFields {
 public:
  /// Writes.
  SentenceFields() = default;
  /// Reads these.
  explicit SentenceFields(std::vector<std::string> fields)
      : fields_(std::move(fields)), is_reading_(true) {}

  /// hhmmss.sss since midnight (UTC).
  void TimeOfDay(Duration& since_midnight);
  /// Seconds since 1970 with 6 decimals.
  void UnixSeconds(Time& time);
  void Number(double& value, int decimals = 3);
  /// An empty field is no value.
  void Number(std::optional<double>& value, int decimals = 3);
  /// Degrees on the wire.
  void Degrees(double& angle_rad, int decimals = 3);
  void Degrees(std::optional<double>& angle_rad, int decimals = 3);
  void Integer(int& value);
  /// "1" or "0".
  void Flag(bool& value) { Choice(value, "1", "0"); }
  void Choice(bool& value, const std::string& if_true, const std::string& if_false);
  /// Two fields: dddmm.mmmmmm and the half of the globe; `positive` and `negative` name the halves.
  void Geographic(std::optional<double>& angle_rad, int degree_digits, const std::string& positive,
                  const std::string& negative);
  void Text(std::string& value) { Exchange(value); }
  /// All fields that are left, commas and all.
  void Rest(std::string& value);
  /// Fields at the end that newer versions have.
  template <class Group>
  void Newer(std::optional<Group>& group) {
    if (is_reading_ && next_ < fields_.size()) group.emplace();
    if (group) group->Visit(*this);
  }

  const std::vector<std::string>& fields() const { return fields_; }
  /// Whether every field was visited, and no more than there are.
  bool is_count_right() const { return !is_short_ && (!is_reading_ || next_ == fields_.size()); }
  /// Whether a field was not what its visit takes.
  bool has_bad_field() const { return has_bad_field_; }

 private:
  void Exchange(std::string& text);

  std::vector<std::string> fields_;
  bool is_reading_ = false;
  std::size_t next_ = 0;
  bool is_short_ = false, has_bad_field_ = false;
};

}  // namespace vog
