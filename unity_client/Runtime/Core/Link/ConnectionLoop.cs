using System;
using System.Net.WebSockets;
using System.Threading;
using System.Threading.Tasks;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Sends and receives on one link, from hello until the link is lost. The connection's thread runs
    /// the sending loop and watches for timeouts. A thread that queues a message also sends it at once
    /// if no send is in progress, because waking the sending thread first would delay a touch. Messages
    /// are received by an asynchronous loop of their own, which always has a receive pending.
    /// </summary>
    internal sealed class ConnectionLoop
    {
        const int IdlePollMs = 250;
        const int SendPollMs = 2;

        readonly Link link;
        readonly ConnectionSettings settings;
        readonly Outbox outbox;
        readonly Dispatcher dispatcher;
        readonly ManualResetEvent handshakeEnded = new ManualResetEvent(false);
        readonly object gate = new object();
        Task inFlight;
        double sentAt;
        long receivedAt;
        volatile string lossReason;
        volatile Welcome welcome;

        static int running;

        public ConnectionLoop(Link link, ConnectionSettings settings, Outbox outbox, Dispatcher dispatcher)
        {
            this.link = link;
            this.settings = settings;
            this.outbox = outbox;
            this.dispatcher = dispatcher;
        }

        /// <summary>Number of receive loops still running in this process.</summary>
        public static int Running { get { return Thread.VolatileRead(ref running); } }

        /// <summary>Time of the last message, on Clock.</summary>
        public double ReceivedAt { get { return SecondsOf(Interlocked.Read(ref receivedAt)); } }

        /// <summary>Sends hello and waits for the welcome; throws LinkException if none comes.</summary>
        public Welcome Handshake(WaitHandle closing)
        {
            MarkReceived();
            Task.Run(new Func<Task>(ReceiveUntilLost));
            Link.WaitFor(link.Send(Hello()), settings.SendTimeoutMs);
            WaitHandle.WaitAny(new[] { handshakeEnded, closing }, settings.ConnectTimeoutMs);
            if (welcome != null) return welcome;
            throw new LinkException(lossReason ?? "the service did not answer hello");
        }

        /// <summary>Sends the messages of the outbox until closing is set; throws LinkException when the link is lost.</summary>
        public void SendUntilLost(WaitHandle closing)
        {
            while (!closing.WaitOne(0))
            {
                if (lossReason != null) throw new LinkException(lossReason);
                bool isBusy, isSent;
                lock (gate)
                {
                    isBusy = IsSending;
                    isSent = !isBusy && SendNext();
                }
                if (isBusy) CheckSend();
                else if (!isSent) outbox.Wait(IdlePollMs);
                if (Clock.Now - ReceivedAt > settings.SilenceS)
                    throw new LinkException("the service has been silent for " + settings.SilenceS + " s");
            }
        }

        /// <summary>Sends the next message from the calling thread, unless a send is in progress. Never blocks.</summary>
        public void SendNow()
        {
            if (!Monitor.TryEnter(gate)) return;
            try
            {
                SendNext();
            }
            finally
            {
                Monitor.Exit(gate);
            }
        }

        /// <summary>Makes the sending thread end this loop with a LinkException that states the reason.</summary>
        public void Fail(string reason)
        {
            lossReason = reason;
            outbox.Wake();
        }

        /// <summary>Whether a send is unfinished or has failed; only the sending thread handles failed sends.</summary>
        bool IsSending { get { return inFlight != null && inFlight.Status != TaskStatus.RanToCompletion; } }

        /// <summary>Polls the pending send. Waiting for its task would allocate memory at every send.</summary>
        void CheckSend()
        {
            Task sending;
            double since;
            lock (gate)
            {
                sending = inFlight;
                since = Clock.Now - sentAt;
            }
            if (sending.IsCompleted || since * 1000.0 > settings.SendTimeoutMs) Link.WaitFor(sending, 0);
            else outbox.Wait(SendPollMs);
        }

        bool SendNext()
        {
            if (IsSending || lossReason != null) return false;
            MsgPackWriter next;
            try
            {
                next = outbox.Next(Clock.Now);
            }
            catch (Exception error)
            {
                dispatcher.Fail(error);
                if (!(error is WireException)) Fail("internal error of the client: " + error.Message);
                return true; // the message that cannot be encoded is dropped; later ones are still sent
            }
            if (next == null) return false;
            try
            {
                sentAt = Clock.Now;
                inFlight = link.Send(next.Written);
            }
            catch (Exception error)
            {
                Fail("the link was lost while sending: " + error.Message);
            }
            return true;
        }

        ArraySegment<byte> Hello()
        {
            var hello = new Hello
            {
                Id = outbox.Ids.Next(),
                Client = new Party { Name = WireText.Within(settings.ClientName, Party.NameMaxLength), Version = settings.ClientVersion },
                Protocol = new ProtocolVersion { Major = Protocol.Major, Minor = Protocol.Minor },
                Role = settings.Role,
                Token = string.IsNullOrEmpty(settings.Token) ? null : WireText.Within(settings.Token, Wire.Hello.TokenMaxLength),
            };
            var writer = new MsgPackWriter();
            hello.Write(writer);
            return writer.Written;
        }

        async Task ReceiveUntilLost()
        {
            Interlocked.Increment(ref running);
            var buffer = new ReceiveBuffer();
            try
            {
                while (true)
                {
                    WebSocketReceiveResult part = await link.Receive(buffer.Free()).ConfigureAwait(false);
                    if (part.MessageType == WebSocketMessageType.Close) throw new LinkException(CloseReason(part));
                    buffer.Add(part.Count);
                    if (!part.EndOfMessage) continue;
                    MarkReceived();
                    Take(buffer.Take(), Clock.Now);
                }
            }
            catch (Exception error)
            {
                if (lossReason == null) Fail(error is LinkException ? error.Message : "the connection to the service was lost");
            }
            finally
            {
                Interlocked.Decrement(ref running);
                handshakeEnded.Set();
            }
        }

        void Take(ArraySegment<byte> message, double now)
        {
            try
            {
                long id;
                Kind kind = Protocol.KindOf(message, out id);
                Kind request = outbox.Requests.MatchAnswer(id, now);
                if (request == Kind.Frame) outbox.Wake();
                if (welcome == null) TakeHandshakeReply(message, kind);
                else if (kind == Kind.Ownership) TakeOwnership(message);
                else if (request == Kind.Set) TakeSetReply(kind);
                else dispatcher.Add(message, kind);
            }
            catch (WireException)
            {
                dispatcher.CountUnreadable();
            }
        }

        void TakeHandshakeReply(ArraySegment<byte> message, Kind kind)
        {
            var reader = new MsgPackReader(message);
            if (kind == Kind.Welcome)
            {
                var reply = new Welcome();
                reply.Read(ref reader, new StringPool());
                // Ownership is reset here and not on the sending thread: the next message may already say
                // that the outputs are free, and a reset after that message would lose it.
                outbox.Ownership.Restart(reply.Owner);
                welcome = reply;
                handshakeEnded.Set();
            }
            else if (kind == Kind.Error)
            {
                var error = new Error();
                error.Read(ref reader, new StringPool());
                lossReason = error.Text;
                handshakeEnded.Set();
            }
        }

        void TakeOwnership(ArraySegment<byte> message)
        {
            var reader = new MsgPackReader(message);
            var ownership = new Ownership();
            ownership.Read(ref reader, new StringPool());
            outbox.Ownership.Follow(ownership.Owner, ownership.Free);
            outbox.Wake();
        }

        /// <summary>An error is ignored: another scene took the outputs first, and an ownership event follows.</summary>
        void TakeSetReply(Kind kind)
        {
            if (kind == Kind.Ok) outbox.OwnershipGranted();
        }

        void MarkReceived()
        {
            Interlocked.Exchange(ref receivedAt, (long)(Clock.Now * 1e6));
        }

        static double SecondsOf(long microseconds)
        {
            return microseconds * 1e-6;
        }

        static string CloseReason(WebSocketReceiveResult part)
        {
            int code = part.CloseStatus == null ? 0 : (int)part.CloseStatus.Value;
            return "the service closed the link (" + code + " " + part.CloseStatusDescription + ")";
        }
    }
}
