// Normals as a pure function of a key, to the last bit those of controllers/mppi/noise.py.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace drake_navbench {

// The words that numpy's SeedSequence(seed, spawn_key=names) generates: M. E. O'Neill,
// "Developing a seed_seq Alternative", https://www.pcg-random.org/posts/developing-a-seed_seq-alternative.html
class SeedWords {
 public:
  SeedWords(std::uint64_t seed, const std::vector<std::uint64_t> & names) {
    std::vector<std::uint32_t> entropy;
    Append(seed, &entropy);
    // A seed of few words is filled up, so that no name is taken for a part of it.
    if (!names.empty() && entropy.size() < kPoolSize) entropy.resize(kPoolSize, 0);
    for (const std::uint64_t name : names) Append(name, &entropy);
    std::uint32_t factor = 0x43b0d7e5;
    for (std::size_t i = 0; i < kPoolSize; ++i) {
      pool_[i] = Hashed(i < entropy.size() ? entropy[i] : 0, 0x931e8875, &factor);
    }
    for (std::size_t from = 0; from < kPoolSize; ++from) {
      for (std::size_t to = 0; to < kPoolSize; ++to) {
        if (from != to) Mix(Hashed(pool_[from], 0x931e8875, &factor), &pool_[to]);
      }
    }
    for (std::size_t from = kPoolSize; from < entropy.size(); ++from) {
      for (std::uint32_t & word : pool_) Mix(Hashed(entropy[from], 0x931e8875, &factor), &word);
    }
  }

  // The next word.
  std::uint32_t operator()() {
    return Hashed(pool_[count_++ % kPoolSize], 0x58f38ded, &factor_);
  }

 private:
  static constexpr std::size_t kPoolSize = 4;

  static void Append(std::uint64_t number, std::vector<std::uint32_t> * words) {
    do {
      words->push_back(static_cast<std::uint32_t>(number));
      number >>= 32;
    } while (number != 0);
  }
  static std::uint32_t Hashed(std::uint32_t word, std::uint32_t step, std::uint32_t * factor) {
    word ^= *factor;
    *factor *= step;
    word *= *factor;
    return word ^ (word >> 16);
  }
  static void Mix(std::uint32_t other, std::uint32_t * word) {
    const std::uint32_t mixed = 0xca01f9ddu * *word - 0x4973f715u * other;
    *word = mixed ^ (mixed >> 16);
  }

  std::array<std::uint32_t, kPoolSize> pool_{};
  std::uint32_t factor_ = 0x8b51f9dd;
  std::size_t count_ = 0;
};

// As many xoshiro128++ generators as a row of samples is wide, side by side: Blackman and Vigna,
// "Scrambled linear pseudorandom number generators", ACM TOMS 47, 2021.
class RowOfUniforms {
 public:
  static constexpr std::size_t kWidth = 64;
  using Row = std::array<float, kWidth>;

  explicit RowOfUniforms(SeedWords words) {
    for (auto & lanes : state_) {
      for (std::uint32_t & word : lanes) word = words();
    }
  }

  // The next row, each in (0, 1): 24 bits fill a mantissa.
  Row operator()() {
    Row row;
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      auto & [a, b, c, d] = state_;
      const std::uint32_t output = RotatedLeft(a[lane] + d[lane], 7) + a[lane];
      const std::uint32_t shifted = b[lane] << 9;
      c[lane] ^= a[lane];
      d[lane] ^= b[lane];
      b[lane] ^= c[lane];
      a[lane] ^= d[lane];
      c[lane] ^= shifted;
      d[lane] = RotatedLeft(d[lane], 11);
      row[lane] = static_cast<float>(output >> 8) * 0x1p-24f + 0x1p-25f;
    }
    return row;
  }

 private:
  static std::uint32_t RotatedLeft(std::uint32_t word, int count) {
    return word << count | word >> (32 - count);
  }

  std::array<std::array<std::uint32_t, kWidth>, 4> state_;
};

// The port's own ln, sine and cosine: those of a system's library differ in the last bits.
inline float LogOf(float number) {
  constexpr float kLn2 = 0.69314718055994530942f;
  constexpr float kSqrt2 = 1.41421356237309504880f;
  std::uint32_t bits;
  std::memcpy(&bits, &number, sizeof bits);
  auto exponent = static_cast<float>(static_cast<std::int32_t>(bits >> 23) - 127);
  bits = (bits & 0x007fffffu) | 0x3f800000u;
  float mantissa;
  std::memcpy(&mantissa, &bits, sizeof mantissa);
  if (mantissa > kSqrt2) {
    mantissa *= 0.5f;
    exponent += 1.0f;
  }
  const float s = (mantissa - 1.0f) / (mantissa + 1.0f);
  const float s2 = s * s;
  constexpr float kThird = 1.0 / 3, kFifth = 1.0 / 5, kSeventh = 1.0 / 7, kNinth = 1.0 / 9;
  const float series = 1.0f + s2 * (kThird + s2 * (kFifth + s2 * (kSeventh + s2 * kNinth)));
  return exponent * kLn2 + 2.0f * s * series;
}

struct SineAndCosine {
  float sine;
  float cosine;
};

// Of an angle from 0 to a few turns.
inline SineAndCosine SineAndCosineOf(float angle) {
  constexpr double kPi = 3.14159265358979323846;
  // A quarter turn in three parts, so that the first products are exact.
  constexpr float kFirst = 1.5703125f, kSecond = 4.837512969970703e-4f;
  constexpr float kThird = static_cast<float>(kPi / 2 - 1.5703125 - 4.837512969970703e-4);
  constexpr auto kQuartersARadian = static_cast<float>(2.0 / kPi);
  const auto quadrant = static_cast<std::int32_t>(angle * kQuartersARadian + 0.5f);
  const auto turns = static_cast<float>(quadrant);
  const float r = ((angle - turns * kFirst) - turns * kSecond) - turns * kThird;
  const float r2 = r * r;
  constexpr float kSine3 = -1.0 / 6, kSine5 = 1.0 / 120, kSine7 = -1.0 / 5040,
                  kSine9 = 1.0 / 362880;
  constexpr float kCosine4 = 1.0 / 24, kCosine6 = -1.0 / 720, kCosine8 = 1.0 / 40320,
                  kCosine10 = -1.0 / 3628800;
  const float sine = r + r * r2 * (kSine3 + r2 * (kSine5 + r2 * (kSine7 + r2 * kSine9)));
  const float cosine = 1.0f - 0.5f * r2 +
                       r2 * r2 * (kCosine4 + r2 * (kCosine6 + r2 * (kCosine8 + r2 * kCosine10)));
  const bool is_swapped = (quadrant & 1) != 0;
  const float first = is_swapped ? cosine : sine;
  const float second = is_swapped ? sine : cosine;
  return {(quadrant & 2) != 0 ? -first : first, ((quadrant + 1) & 2) != 0 ? -second : second};
}

// Calls set(sample, step, normal) for each of `samples` horizons of `steps`, N(0, deviation^2).
template <typename Set>
void DrawNormals(std::uint64_t seed, const std::vector<std::uint64_t> & names, float deviation,
                 std::size_t samples, std::size_t steps, Set set) {
  constexpr std::size_t kWidth = RowOfUniforms::kWidth;
  RowOfUniforms next(SeedWords(seed, names));
  const std::size_t rows = (samples + kWidth - 1) / kWidth * steps;
  const auto put = [&](std::size_t row, const RowOfUniforms::Row & normals) {
    if (row >= rows) return;
    const std::size_t first = row / steps * kWidth;
    const std::size_t count = std::min(kWidth, samples - first);
    for (std::size_t lane = 0; lane < count; ++lane) set(first + lane, row % steps, normals[lane]);
  };
  RowOfUniforms::Row cosines, sines;
  // Box and Muller: two rows of uniforms make two of normals. The loop over a row has no branch, so
  // that a compiler takes several lanes at once; that changes no bit.
  for (std::size_t row = 0; row < rows; row += 2) {
    const auto lengths = next();
    const auto turns = next();
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      const float squared = -2.0f * LogOf(lengths[lane]);
      const float length = deviation * std::sqrt(squared > 0.0f ? squared : 0.0f);
      const auto [sine, cosine] = SineAndCosineOf(6.28318530717958647692f * turns[lane]);
      cosines[lane] = length * cosine;
      sines[lane] = length * sine;
    }
    put(row, cosines);
    put(row + 1, sines);
  }
}

}  // namespace drake_navbench
