extends RefCounted
## One WebSocket to the service, opened anew whenever it is lost. It carries maps of any meaning.
##
## Messages are JSON; those that carry a picture are MessagePack. `poll` is called once a frame and
## never waits: what has arrived is handed on, what is sent goes into the socket's own buffer.

const MessagePack := preload("message_pack.gd")
const PROTOCOL := {"major": 1, "minor": 1}
const HERE := "ws://127.0.0.1:8790/"
const FIRST_WAIT_S := 0.25  # before the first reconnect; doubled each time, with jitter
const LONGEST_WAIT_S := 5.0
const LONGEST_FRAME_S := 0.5
const SILENCE_S := 5.0  # telemetry comes ten times a second: a link silent this long is lost

## Called with each message, and with what its request was asked as ("" for events).
var on_message: Callable
var on_lost: Callable
var is_open := false  # the service has answered `hello`
var said := ""  # why the last link ended, in words

var _socket: WebSocketPeer
var _url := ""
var _token := ""
var _has_greeted := false
var _next_id := 1
var _asked := {}  # request id -> what it was asked as, until it is answered
var _wait_s := FIRST_WAIT_S
var _retry_at := 0.0
var _silent_s := 0.0
var _polled_at := 0.0


func open(url: String, token: String) -> void:
	_url = url
	_token = token
	_socket = WebSocketPeer.new()
	_socket.outbound_buffer_size = 4 << 20
	_socket.inbound_buffer_size = 1 << 20
	_has_greeted = false
	_silent_s = 0.0
	_polled_at = now_s()
	if _socket.connect_to_url(url) != OK:
		_lose("not the address of a WebSocket")


## Where the service is, as the project says. A page that the service itself serves talks to that
## service; all else to this machine.
static func address() -> String:
	var given: String = ProjectSettings.get_setting("hapticvlm/url", "")
	if not given.is_empty():
		return given
	if not OS.has_feature("web"):
		return HERE
	var location := JavaScriptBridge.get_interface("location")
	if not str(location.pathname).begins_with("/scene/"):
		return HERE
	return "%s://%s/" % ["wss" if location.protocol == "https:" else "ws", location.host]


## End the link, with a close that the service sees at once.
func close(why: String) -> void:
	if _socket == null:
		return
	_socket.close(1000, why)
	_socket.poll()
	_lose(why)


func poll() -> void:
	if _socket == null:
		if now_s() >= _retry_at and not _url.is_empty():
			open(_url, _token)
		return
	_socket.poll()
	var state := _socket.get_ready_state()
	if state == WebSocketPeer.STATE_CLOSED:
		_lose(_socket.get_close_reason())
	elif state == WebSocketPeer.STATE_OPEN:
		_greet()
		_receive_all()
	if _socket != null and _is_silent():
		close("nothing heard for %d s" % SILENCE_S)


## Send a message; return its id. `asked` comes back with the answer.
func tell(type: String, fields: Dictionary, asked := "") -> int:
	var message := _numbered(type, fields, asked)
	_socket.send_text(JSON.stringify(message, "", false, true))
	return message["id"]


## The same for a message that carries a picture.
func tell_packed(type: String, fields: Dictionary) -> int:
	var message := _numbered(type, fields, "")
	_socket.send(MessagePack.encode(message))
	return message["id"]


static func now_s() -> float:
	return Time.get_ticks_usec() * 1e-6


func _numbered(type: String, fields: Dictionary, asked: String) -> Dictionary:
	var id := _next_id
	_next_id += 1
	_asked[id] = type if asked.is_empty() else asked
	return fields.merged({"type": type, "id": id})


func _greet() -> void:
	if _has_greeted:
		return
	_has_greeted = true
	var client := {"name": "godot %s" % Engine.get_version_info()["string"], "version": "1.0.0"}
	var hello := {"role": "scene", "protocol": PROTOCOL, "client": client}
	if not _token.is_empty():
		hello["token"] = _token
	tell("hello", hello)


## A frame that took seconds, as the first ones do, is no silence of the service.
func _is_silent() -> bool:
	_silent_s += minf(LONGEST_FRAME_S, now_s() - _polled_at)
	_polled_at = now_s()
	return _silent_s > SILENCE_S


func _receive_all() -> void:
	while _socket != null and _socket.get_available_packet_count() > 0:
		_silent_s = 0.0
		var message: Variant = JSON.parse_string(_socket.get_packet().get_string_from_utf8())
		if message is Dictionary:
			_receive(message)


func _receive(message: Dictionary) -> void:
	var id := int(message.get("id", 0))
	var asked: String = _asked.get(id, "")
	_asked.erase(id)
	if message.get("type") == "welcome":
		is_open = true
		said = ""
		_wait_s = FIRST_WAIT_S
	elif asked == "hello":
		said = message.get("text", "")
	on_message.call(message, asked)


func _lose(why: String) -> void:
	var was_open := is_open
	is_open = false
	_socket = null
	_asked.clear()
	said = why if said.is_empty() or not why.is_empty() else said
	_retry_at = now_s() + _wait_s * randf_range(0.5, 1.5)
	_wait_s = minf(LONGEST_WAIT_S, 2.0 * _wait_s)
	if was_open:
		on_lost.call()
