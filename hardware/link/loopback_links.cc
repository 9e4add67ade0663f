#include "hardware/link/loopback_links.h"

#include <algorithm>
#include <deque>

namespace vog {
namespace {

/// One direction.
template <class Item>
using Queue = std::shared_ptr<std::deque<Item>>;

/// The other end holds the queue too, as long as it is there.
template <class Item>
ReadOutcome OutcomeOfEmpty(const Queue<Item>& queue) {
  return queue.use_count() > 1 ? ReadOutcome::kNothing : ReadOutcome::kClosed;
}

class LoopbackLink : public ByteLink {
 public:
  LoopbackLink(Queue<std::uint8_t> in, Queue<std::uint8_t> out)
      : in_(std::move(in)), out_(std::move(out)) {}

  int fd() const override { return -1; }
  void Step(Time) override {}

  ByteRead Read(std::span<std::uint8_t> into) override {
    if (in_->empty()) return {OutcomeOfEmpty(in_)};
    const std::size_t size = std::min(into.size(), in_->size());
    const auto end = in_->begin() + static_cast<std::ptrdiff_t>(size);
    std::copy(in_->begin(), end, into.begin());
    in_->erase(in_->begin(), end);
    counters_.bytes_in += static_cast<std::int64_t>(size);
    return {ReadOutcome::kData, size};
  }

  void Write(std::span<const std::uint8_t> bytes) override {
    if (out_.use_count() < 2 || out_->size() + bytes.size() > kMaxLoopbackBytes) {
      ++counters_.dropped;
      return;
    }
    out_->insert(out_->end(), bytes.begin(), bytes.end());
    counters_.bytes_out += static_cast<std::int64_t>(bytes.size());
  }

 private:
  Queue<std::uint8_t> in_, out_;
};

class LoopbackCan : public CanLink {
 public:
  LoopbackCan(Queue<CanFrame> in, Queue<CanFrame> out) : in_(std::move(in)), out_(std::move(out)) {}

  int fd() const override { return -1; }
  void Step(Time) override {}

  CanRead Read() override {
    if (in_->empty()) return {OutcomeOfEmpty(in_)};
    const CanFrame frame = in_->front();
    in_->pop_front();
    counters_.bytes_in += frame.size;
    return {ReadOutcome::kData, frame};
  }

  void Write(const CanFrame& frame) override {
    if (out_.use_count() < 2 || out_->size() == kMaxLoopbackFrames) {
      ++counters_.dropped;
      return;
    }
    out_->push_back(frame);
    counters_.bytes_out += frame.size;
  }

 private:
  Queue<CanFrame> in_, out_;
};

template <class Interface, class End, class Item>
std::pair<std::unique_ptr<Interface>, std::unique_ptr<Interface>> MakePair() {
  const auto there = std::make_shared<std::deque<Item>>(),
             back = std::make_shared<std::deque<Item>>();
  return {std::make_unique<End>(back, there), std::make_unique<End>(there, back)};
}

}  // namespace

std::pair<std::unique_ptr<ByteLink>, std::unique_ptr<ByteLink>> MakeLoopback() {
  return MakePair<ByteLink, LoopbackLink, std::uint8_t>();
}

std::pair<std::unique_ptr<CanLink>, std::unique_ptr<CanLink>> MakeCanLoopback() {
  return MakePair<CanLink, LoopbackCan, CanFrame>();
}

}  // namespace vog
