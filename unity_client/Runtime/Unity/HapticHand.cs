using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM
{
    /// <summary>
    /// A hand or finger that feels. Put it beside a collider (and a Rigidbody, as physics needs one to
    /// report): collisions and triggers with HapticObjects become approach, contact, slide, release.
    /// </summary>
    [DisallowMultipleComponent, AddComponentMenu("HapticVLM/Haptic Hand")]
    public sealed class HapticHand : MonoBehaviour
    {
        const float ApproachPeriodS = 0.1f;
        const double RenewalsPerS = 20.0; // a lease lasts 250 ms

        [SerializeField]
        HandName hand = HandName.Right;

        [SerializeField, Range(0f, 0.5f), Tooltip("An object this near is about to be touched, m; 0: never.")]
        float approachM = 0.08f;

        [SerializeField, Range(0f, 50f), Tooltip("Triggers report no force: newtons per m/s of the hand. A guess; tune it to your hand.")]
        float newtonsPerMps = 4f;

        readonly Collider[] near = new Collider[16];
        HandTouches touches;
        Vector3 lastPosition;
        float speedMps;
        float lookAt;

        /// <summary>The object this hand touches; null when none.</summary>
        public string TouchedObjectId { get { return touches == null ? null : touches.ObjectId; } }

        static HapticConnection Link { get { return HapticClient.Active == null ? null : HapticClient.Active.Connection; } }

        void OnEnable()
        {
            touches = new HandTouches(hand, RenewalsPerS);
            lastPosition = transform.position;
            speedMps = 0f;
        }

        void OnDisable()
        {
            touches.EndAll(Link);
        }

        void FixedUpdate()
        {
            Vector3 position = transform.position;
            speedMps = (position - lastPosition).magnitude / Time.fixedDeltaTime;
            lastPosition = position;
        }

        void Update()
        {
            if (!touches.IsTouching && approachM > 0f && Time.unscaledTime >= lookAt)
            {
                lookAt = Time.unscaledTime + ApproachPeriodS;
                HapticObject nearest = Nearest();
                touches.Near(nearest == null ? null : nearest.ObjectId, Link);
            }
            EndVanished();
            touches.Tick(Clock.Now, Link);
        }

        void OnCollisionEnter(Collision collision)
        {
            Begin(collision.collider, collision.relativeVelocity.magnitude, ForceOf(collision));
        }

        void OnCollisionStay(Collision collision)
        {
            touches.Follow(collision.collider, collision.relativeVelocity.magnitude, ForceOf(collision));
        }

        void OnCollisionExit(Collision collision)
        {
            touches.End(collision.collider, Link);
        }

        void OnTriggerEnter(Collider other)
        {
            Begin(other, speedMps, speedMps * newtonsPerMps);
        }

        void OnTriggerStay(Collider other)
        {
            touches.Follow(other, speedMps, speedMps * newtonsPerMps);
        }

        void OnTriggerExit(Collider other)
        {
            touches.End(other, Link);
        }

        void Begin(Collider other, double speed, double force)
        {
            var target = other.GetComponentInParent<HapticObject>();
            if (target == null || !target.isActiveAndEnabled) return;
            touches.Begin(other, target.ObjectId, speed, force, Link);
        }

        /// <summary>Physics reports no exit from a collider that was destroyed or switched off.</summary>
        void EndVanished()
        {
            for (int i = touches.Count - 1; i >= 0; i--)
            {
                object key = touches.Key(i);
                var collider = (Collider)key;
                if (collider == null || !collider.enabled || !collider.gameObject.activeInHierarchy) touches.End(key, Link);
            }
        }

        static double ForceOf(Collision collision)
        {
            return collision.impulse.magnitude / Time.fixedDeltaTime;
        }

        HapticObject Nearest()
        {
            int count = Physics.OverlapSphereNonAlloc(transform.position, approachM, near);
            HapticObject nearest = null;
            float least = float.PositiveInfinity;
            for (int i = 0; i < count; i++)
            {
                float distance = near[i].bounds.SqrDistance(transform.position);
                if (distance >= least) continue;
                var candidate = near[i].GetComponentInParent<HapticObject>();
                if (candidate == null) continue;
                nearest = candidate;
                least = distance;
            }
            return nearest;
        }
    }
}
