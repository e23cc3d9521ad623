// The part of MessagePack that the protocol of docs/external_controllers.md uses.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace msgpack {

// A value of MessagePack: nil, flag, whole number, number, text, bytes, array or map.
class Value {
 public:
  enum class Type { kNil, kBool, kInt, kDouble, kText, kBytes, kArray, kMap };
  using Array = std::vector<Value>;
  using Map = std::map<std::string, Value>;

  Value() = default;
  Value(bool flag) : type_(Type::kBool), int_(flag) {}
  Value(int number) : type_(Type::kInt), int_(number) {}
  Value(std::int64_t number) : type_(Type::kInt), int_(number) {}
  Value(double number) : type_(Type::kDouble), double_(number) {}
  Value(const char* text) : type_(Type::kText), text_(text) {}
  Value(std::string text) : type_(Type::kText), text_(std::move(text)) {}
  Value(Array array) : type_(Type::kArray), array_(std::move(array)) {}
  Value(Map map) : type_(Type::kMap), map_(std::move(map)) {}
  static Value Bytes(std::string bytes) {
    Value value(std::move(bytes));
    value.type_ = Type::kBytes;
    return value;
  }

  Type type() const { return type_; }
  bool is_nil() const { return type_ == Type::kNil; }
  bool boolean() const { return Checked(Type::kBool).int_ != 0; }
  std::int64_t integer() const { return Checked(Type::kInt).int_; }
  // Numbers that happen to be whole may come as integers.
  double number() const {
    return type_ == Type::kInt ? static_cast<double>(int_) : Checked(Type::kDouble).double_;
  }
  const std::string& text() const { return Checked(Type::kText).text_; }
  const std::string& bytes() const { return Checked(Type::kBytes).text_; }
  const Array& array() const { return Checked(Type::kArray).array_; }
  const Map& map() const { return Checked(Type::kMap).map_; }

  // The entry of a map.
  const Value& operator[](const char* key) const {
    const auto found = map().find(key);
    if (found == map().end()) throw std::runtime_error(std::string("no ") + key);
    return found->second;
  }
  // The number at a place of an array.
  double number_at(std::size_t index) const { return array().at(index).number(); }

 private:
  const Value& Checked(Type type) const {
    if (type_ != type) throw std::runtime_error("a value of another type than expected");
    return *this;
  }

  Type type_ = Type::kNil;
  std::int64_t int_ = 0;
  double double_ = 0.0;
  std::string text_;
  Array array_;
  Map map_;
};

// Reads one value after the other. All numbers in MessagePack are big-endian.
class Reader {
 public:
  explicit Reader(const std::string& data) : data_(data) {}

  Value Read() {
    const auto tag = static_cast<std::uint8_t>(Take(1)[0]);
    if (tag <= 0x7f) return Value(static_cast<std::int64_t>(tag));
    if (tag >= 0xe0) return Value(static_cast<std::int64_t>(static_cast<std::int8_t>(tag)));
    if ((tag & 0xf0) == 0x80) return ReadMap(tag & 0x0f);
    if ((tag & 0xf0) == 0x90) return ReadArray(tag & 0x0f);
    if ((tag & 0xe0) == 0xa0) return Value(std::string(Take(tag & 0x1f), tag & 0x1fu));
    switch (tag) {
      case 0xc0: return Value();
      case 0xc2: return Value(false);
      case 0xc3: return Value(true);
      case 0xc4: return ReadBytes(ReadUnsigned(1));
      case 0xc5: return ReadBytes(ReadUnsigned(2));
      case 0xc6: return ReadBytes(ReadUnsigned(4));
      case 0xca: return Value(static_cast<double>(ReadFloat<float, std::uint32_t>()));
      case 0xcb: return Value(ReadFloat<double, std::uint64_t>());
      case 0xcc: return Value(static_cast<std::int64_t>(ReadUnsigned(1)));
      case 0xcd: return Value(static_cast<std::int64_t>(ReadUnsigned(2)));
      case 0xce: return Value(static_cast<std::int64_t>(ReadUnsigned(4)));
      // A seed may be larger than an int64; its bits are what counts.
      case 0xcf: return Value(static_cast<std::int64_t>(ReadUnsigned(8)));
      case 0xd0: return Value(static_cast<std::int64_t>(static_cast<std::int8_t>(ReadUnsigned(1))));
      case 0xd1: return Value(static_cast<std::int64_t>(static_cast<std::int16_t>(ReadUnsigned(2))));
      case 0xd2: return Value(static_cast<std::int64_t>(static_cast<std::int32_t>(ReadUnsigned(4))));
      case 0xd3: return Value(static_cast<std::int64_t>(ReadUnsigned(8)));
      case 0xd9: return ReadText(ReadUnsigned(1));
      case 0xda: return ReadText(ReadUnsigned(2));
      case 0xdb: return ReadText(ReadUnsigned(4));
      case 0xdc: return ReadArray(ReadUnsigned(2));
      case 0xdd: return ReadArray(ReadUnsigned(4));
      case 0xde: return ReadMap(ReadUnsigned(2));
      case 0xdf: return ReadMap(ReadUnsigned(4));
      default: throw std::runtime_error("a type that the protocol does not use");
    }
  }

 private:
  const char* Take(std::size_t count) {
    if (data_.size() - position_ < count) throw std::runtime_error("a message that is cut off");
    const char* start = data_.data() + position_;
    position_ += count;
    return start;
  }
  std::uint64_t ReadUnsigned(int count) {
    const char* start = Take(count);
    std::uint64_t number = 0;
    for (int i = 0; i < count; ++i) number = number << 8 | static_cast<std::uint8_t>(start[i]);
    return number;
  }
  template <typename Number, typename Bits>
  Number ReadFloat() {
    const Bits bits = static_cast<Bits>(ReadUnsigned(sizeof(Bits)));
    Number number;
    std::memcpy(&number, &bits, sizeof number);
    return number;
  }
  Value ReadText(std::size_t count) { return Value(std::string(Take(count), count)); }
  Value ReadBytes(std::size_t count) { return Value::Bytes(std::string(Take(count), count)); }
  Value ReadArray(std::size_t count) {
    Value::Array array;
    for (std::size_t i = 0; i < count; ++i) array.push_back(Read());
    return Value(std::move(array));
  }
  Value ReadMap(std::size_t count) {
    Value::Map map;
    for (std::size_t i = 0; i < count; ++i) {
      std::string key = Read().text();
      map[std::move(key)] = Read();
    }
    return Value(std::move(map));
  }

  const std::string& data_;
  std::size_t position_ = 0;
};

inline void AppendBigEndian(std::string* out, std::uint64_t number, int count) {
  for (int i = count - 1; i >= 0; --i) out->push_back(static_cast<char>(number >> (8 * i)));
}

// Appends a value, always in the longest form of its type: shorter ones are allowed, not needed.
inline void Append(std::string* out, const Value& value) {
  switch (value.type()) {
    case Value::Type::kNil: out->push_back('\xc0'); break;
    case Value::Type::kBool: out->push_back(value.boolean() ? '\xc3' : '\xc2'); break;
    case Value::Type::kInt:
      out->push_back('\xd3');
      AppendBigEndian(out, static_cast<std::uint64_t>(value.integer()), 8);
      break;
    case Value::Type::kDouble: {
      const double number = value.number();
      std::uint64_t bits;
      std::memcpy(&bits, &number, sizeof bits);
      out->push_back('\xcb');
      AppendBigEndian(out, bits, 8);
      break;
    }
    case Value::Type::kText:
      out->push_back('\xdb');
      AppendBigEndian(out, value.text().size(), 4);
      out->append(value.text());
      break;
    case Value::Type::kBytes:
      out->push_back('\xc6');
      AppendBigEndian(out, value.bytes().size(), 4);
      out->append(value.bytes());
      break;
    case Value::Type::kArray:
      out->push_back('\xdd');
      AppendBigEndian(out, value.array().size(), 4);
      for (const Value& entry : value.array()) Append(out, entry);
      break;
    case Value::Type::kMap:
      out->push_back('\xdf');
      AppendBigEndian(out, value.map().size(), 4);
      for (const auto& [key, entry] : value.map()) {
        Append(out, Value(key));
        Append(out, entry);
      }
      break;
  }
}

}  // namespace msgpack
