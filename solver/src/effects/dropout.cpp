// Dropout: samples are lost at random, each with the same probability, the same ones in every run with the same seed.
// The random numbers are SplitMix64 of the sample's number (G. L. Steele et al., OOPSLA 2014).
#include <cstdint>

#include "effects/effect.hpp"

namespace rille::effects {
namespace {

class Dropout final : public SensorEffect {
 public:
  Dropout(double fraction, double seed) : fraction_(fraction), seed_(seed) {}
  void distort(Reading& reading, long long number) const override {
    std::uint64_t x = static_cast<std::uint64_t>(number) * 0x9e3779b97f4a7c15ULL + static_cast<std::uint64_t>(seed_) * 0xd1342543de82ef95ULL;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    x ^= x >> 31;
    if (static_cast<double>(x >> 11) * 0x1.0p-53 < fraction_) reading.lost = true;
  }

 private:
  double fraction_;  // [-] of samples that are lost
  double seed_;  // [-] whole number
};

}  // namespace

void attach_dropout(const Attachment& a) { a.to_sensors<Dropout>(a["fraction"], a["seed"]); }

}  // namespace rille::effects
