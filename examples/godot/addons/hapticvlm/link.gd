extends RefCounted
## One WebSocket to the service that reconnects when it is lost. It transports messages without interpreting them.
##
## Messages are JSON; those with a picture are MessagePack. `poll` is called once per frame and
## never blocks: it passes on received messages, and sent ones go to the socket's buffer.

const MessagePack := preload("message_pack.gd")
const PROTOCOL := {"major": 1, "minor": 2}
const LOCAL_URL := "ws://127.0.0.1:8790/"
const FIRST_WAIT_S := 0.25  # before the first reconnect; doubled each time, with jitter
const LONGEST_WAIT_S := 5.0
const LONGEST_FRAME_S := 0.5
const SILENCE_S := 5.0  # telemetry arrives ten times a second, so a link silent this long is lost

## Called with each message and the label of its request ("" for events).
var on_message: Callable
var on_lost: Callable
var is_open := false  # the service has answered `hello`
var said := ""  # the reason why the last link ended

var _socket: WebSocketPeer
var _url := ""
var _token := ""
var _has_sent_hello := false
var _next_id := 1
var _asked := {}  # unanswered request id -> its label
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
	_has_sent_hello = false
	_silent_s = 0.0
	_polled_at = now_s()
	if _socket.connect_to_url(url) != OK:
		_lose("not a WebSocket address")


## Returns the address from the project settings. Otherwise a page served by the service connects to that
## service, and everything else to this machine.
static func address() -> String:
	var setting: String = ProjectSettings.get_setting("hapticvlm/url", "")
	if not setting.is_empty():
		return setting
	if not OS.has_feature("web"):
		return LOCAL_URL
	var location := JavaScriptBridge.get_interface("location")
	if not str(location.pathname).begins_with("/scene/"):
		return LOCAL_URL
	return "%s://%s/" % ["wss" if location.protocol == "https:" else "ws", location.host]


## Closes the link with a close frame, so that the service notices at once.
func close(reason: String) -> void:
	if _socket == null:
		return
	_socket.close(1000, reason)
	_socket.poll()
	_lose(reason)


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
		_send_hello()
		_receive_all()
	if _socket != null and _is_silent():
		close("no message for %d s" % SILENCE_S)


## Sends a message and returns its id. `asked` is passed on with the answer.
func send(type: String, fields: Dictionary, asked := "") -> int:
	var message := _numbered(type, fields, asked)
	_socket.send_text(JSON.stringify(message, "", false, true))
	return message["id"]


## Sends a message with a picture and returns its id.
func send_packed(type: String, fields: Dictionary) -> int:
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


func _send_hello() -> void:
	if _has_sent_hello:
		return
	_has_sent_hello = true
	var client := {"name": "godot %s" % Engine.get_version_info()["string"], "version": "1.0.0"}
	var hello := {"role": "scene", "protocol": PROTOCOL, "client": client}
	if not _token.is_empty():
		hello["token"] = _token
	send("hello", hello)


## Measures silence without long frames, since the first frames can take seconds.
func _is_silent() -> bool:
	_silent_s += minf(LONGEST_FRAME_S, now_s() - _polled_at)
	_polled_at = now_s()
	return _silent_s > SILENCE_S


func _receive_all() -> void:
	while _socket != null and _socket.get_available_packet_count() > 0:
		_silent_s = 0.0
		var packet := _socket.get_packet()
		if not _socket.was_string_packet():
			continue  # an error of a service that has not read a hello yet, and does not know its encoding
		var message: Variant = JSON.parse_string(packet.get_string_from_utf8())
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


func _lose(reason: String) -> void:
	var was_open := is_open
	is_open = false
	_socket = null
	_asked.clear()
	said = reason if said.is_empty() or not reason.is_empty() else said
	_retry_at = now_s() + _wait_s * randf_range(0.5, 1.5)
	_wait_s = minf(LONGEST_WAIT_S, 2.0 * _wait_s)
	if was_open:
		on_lost.call()
