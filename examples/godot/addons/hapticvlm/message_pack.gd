extends RefCounted
## Encodes MessagePack for messages with a picture, because JSON cannot contain bytes.
##
## Supports the types of the protocol: maps with string keys, lists, strings, bytes, numbers, booleans.


static func encode(value: Variant) -> PackedByteArray:
	var out := StreamPeerBuffer.new()
	out.big_endian = true
	_write(out, value)
	return out.data_array


static func _write(out: StreamPeerBuffer, value: Variant) -> void:
	match typeof(value):
		TYPE_BOOL:
			out.put_u8(0xC3 if value else 0xC2)
		TYPE_INT:
			out.put_u8(0xD3)
			out.put_64(value)
		TYPE_FLOAT:
			out.put_u8(0xCB)
			out.put_double(value)
		TYPE_STRING, TYPE_STRING_NAME:
			_write_text(out, str(value).to_utf8_buffer())
		TYPE_PACKED_BYTE_ARRAY:
			out.put_u8(0xC6)
			out.put_u32(value.size())
			out.put_data(value)
		TYPE_ARRAY:
			out.put_u8(0xDD)
			out.put_u32(value.size())
			for item: Variant in value:
				_write(out, item)
		TYPE_DICTIONARY:
			out.put_u8(0xDF)
			out.put_u32(value.size())
			for key: Variant in value:
				_write(out, key)
				_write(out, value[key])
		TYPE_NIL:
			out.put_u8(0xC0)
		_:
			if typeof(value) >= TYPE_PACKED_BYTE_ARRAY:  # one of the packed lists of numbers or texts
				_write(out, Array(value))
				return
			push_error("hapticvlm: %s cannot be sent; use numbers, texts, lists and dictionaries" % type_string(typeof(value)))
			out.put_u8(0xC0)


static func _write_text(out: StreamPeerBuffer, text: PackedByteArray) -> void:
	out.put_u8(0xDB)
	out.put_u32(text.size())
	out.put_data(text)
