using System;
using System.Net.WebSockets;
using System.Threading;
using System.Threading.Tasks;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// The life of one link from hello to its loss. One thread sends and watches; a message is sent at
    /// once by the thread that brings it when nothing else is being sent, which saves a touch the
    /// wake-up of that thread. Receiving is a loop of its own, always on.
    /// </summary>
    internal sealed class Conversation
    {
        const int LookRoundMs = 250;
        const int SendRoundMs = 2;

        readonly Link link;
        readonly ConnectionSettings settings;
        readonly Outbox outbox;
        readonly Dispatcher dispatcher;
        readonly ManualResetEvent greeted = new ManualResetEvent(false);
        readonly object gate = new object();
        Task inFlight;
        double sentAt;
        long heardAt;
        volatile string lostBecause;
        volatile Welcome welcome;

        static int running;

        public Conversation(Link link, ConnectionSettings settings, Outbox outbox, Dispatcher dispatcher)
        {
            this.link = link;
            this.settings = settings;
            this.outbox = outbox;
            this.dispatcher = dispatcher;
        }

        /// <summary>Receive loops that have not ended yet.</summary>
        public static int Running { get { return Thread.VolatileRead(ref running); } }

        /// <summary>Says hello and waits for the welcome; throws LinkException.</summary>
        public Welcome Greet(WaitHandle closing)
        {
            Heard();
            Task.Run(new Func<Task>(ReceiveUntilLost));
            Link.WaitFor(link.Send(Hello()), settings.SendTimeoutMs);
            WaitHandle.WaitAny(new[] { greeted, closing }, settings.ConnectTimeoutMs);
            if (welcome != null) return welcome;
            throw new LinkException(lostBecause ?? "the service did not answer hello");
        }

        /// <summary>Sends what the outbox holds until closing is set; throws LinkException when lost.</summary>
        public void SendUntilLost(WaitHandle closing)
        {
            while (!closing.WaitOne(0))
            {
                if (lostBecause != null) throw new LinkException(lostBecause);
                bool isBusy, isSent;
                lock (gate)
                {
                    isBusy = IsSending;
                    isSent = !isBusy && SendNext();
                }
                if (isBusy) FollowSend();
                else if (!isSent) outbox.Wait(LookRoundMs);
                if (Clock.Now - SecondsOf(Interlocked.Read(ref heardAt)) > settings.SilenceS)
                    throw new LinkException("the service has been silent for " + settings.SilenceS + " s");
            }
        }

        /// <summary>Sends the next message from the calling thread if none is being sent. Never waits.</summary>
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

        /// <summary>Has the sending thread end this conversation.</summary>
        public void GiveUp(string why)
        {
            lostBecause = why;
            outbox.Wake();
        }

        /// <summary>Whether a send has not succeeded yet; only the sending thread deals with failed ones.</summary>
        bool IsSending { get { return inFlight != null && inFlight.Status != TaskStatus.RanToCompletion; } }

        /// <summary>Looks again soon instead of waiting for the task, which would allocate at every send.</summary>
        void FollowSend()
        {
            Task sending;
            double since;
            lock (gate)
            {
                sending = inFlight;
                since = Clock.Now - sentAt;
            }
            if (sending.IsCompleted || since * 1000.0 > settings.SendTimeoutMs) Link.WaitFor(sending, 0);
            else outbox.Wait(SendRoundMs);
        }

        bool SendNext()
        {
            if (IsSending || lostBecause != null) return false;
            MsgPackWriter next;
            try
            {
                next = outbox.Next(Clock.Now);
            }
            catch (Exception error)
            {
                dispatcher.Fail(error);
                if (!(error is WireException)) GiveUp("an error of the client: " + error.Message);
                return true; // the message that cannot be written is dropped, the next ones go out
            }
            if (next == null) return false;
            try
            {
                sentAt = Clock.Now;
                inFlight = link.Send(next.Written);
            }
            catch (Exception error)
            {
                GiveUp("the link was lost while sending: " + error.Message);
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
                    if (part.MessageType == WebSocketMessageType.Close) throw new LinkException(Goodbye(part));
                    buffer.Add(part.Count);
                    if (!part.EndOfMessage) continue;
                    Heard();
                    Take(buffer.Take(), Clock.Now);
                }
            }
            catch (Exception error)
            {
                if (lostBecause == null) GiveUp(error is LinkException ? error.Message : "the service is gone");
            }
            finally
            {
                Interlocked.Decrement(ref running);
                greeted.Set();
            }
        }

        void Take(ArraySegment<byte> message, double now)
        {
            try
            {
                long id;
                Kind kind = Protocol.KindOf(message, out id);
                Kind asked = outbox.Requests.Answered(id, now);
                if (asked == Kind.Frame) outbox.Wake();
                if (welcome == null) TakeGreeting(message, kind);
                else if (kind == Kind.Ownership) TakeOwnership(message);
                else if (asked == Kind.Set) TakeAnswer(kind);
                else dispatcher.Add(message, kind);
            }
            catch (WireException)
            {
                dispatcher.CountUnreadable();
            }
        }

        void TakeGreeting(ArraySegment<byte> message, Kind kind)
        {
            var reader = new MsgPackReader(message);
            if (kind == Kind.Welcome)
            {
                var said = new Welcome();
                said.Read(ref reader, new StringPool());
                // Here and not on the sending thread: the next message may already say that the outputs
                // are free, and what begins anew after it would forget that.
                outbox.Ownership.Restart(said.Owner);
                welcome = said;
                greeted.Set();
            }
            else if (kind == Kind.Error)
            {
                var said = new Error();
                said.Read(ref reader, new StringPool());
                lostBecause = said.Text;
                greeted.Set();
            }
        }

        void TakeOwnership(ArraySegment<byte> message)
        {
            var reader = new MsgPackReader(message);
            var said = new Ownership();
            said.Read(ref reader, new StringPool());
            outbox.Ownership.Follow(said.Owner, said.Free);
            outbox.Wake();
        }

        /// <summary>A refusal needs no report: another scene was quicker, and the next event will come.</summary>
        void TakeAnswer(Kind kind)
        {
            if (kind == Kind.Ok) outbox.OwnershipGranted();
        }

        void Heard()
        {
            Interlocked.Exchange(ref heardAt, (long)(Clock.Now * 1e6));
        }

        static double SecondsOf(long microseconds)
        {
            return microseconds * 1e-6;
        }

        static string Goodbye(WebSocketReceiveResult part)
        {
            int code = part.CloseStatus == null ? 0 : (int)part.CloseStatus.Value;
            return "the service closed the link (" + code + " " + part.CloseStatusDescription + ")";
        }
    }
}
