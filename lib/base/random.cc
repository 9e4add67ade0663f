#include "lib/base/random.h"

namespace vog {
namespace {

std::uint64_t Mix(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

// FNV-1a.
std::uint64_t HashOf(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const unsigned char c : text) hash = (hash ^ c) * 0x100000001b3u;
  return hash;
}

}  // namespace

std::uint64_t Random::Engine::operator()() { return Mix(state += 0x9e3779b97f4a7c15u); }

Random::Random(std::uint64_t seed, std::string_view stream, std::uint64_t step)
    : engine_{Mix(Mix(Mix(seed + 0x9e3779b97f4a7c15u) ^ HashOf(stream)) + step)} {}

double Random::Uniform(double lo, double hi) {
  return std::uniform_real_distribution<double>(lo, hi)(engine_);
}

double Random::Gaussian(double sigma) {
  // A fresh distribution each time: std::normal_distribution keeps a second draw back.
  return sigma * std::normal_distribution<double>()(engine_);
}

Eigen::Vector3d Random::GaussianVector(const Eigen::Vector3d& sigma) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) v[i] = Gaussian(sigma[i]);
  return v;
}

bool Random::Chance(double probability) { return Uniform(0, 1) < probability; }

int Random::Index(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }

}  // namespace vog
